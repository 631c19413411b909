#pragma once

#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/output/exr.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/pings_csv.h>

#include "support/sample_waterfall.h"
#include "support/small_recording.h"
#include "support/written_bytes.h"

namespace ensonify::tests {

/// The files of a run of three pings, as texts.
struct SmallRun {
  std::string image, table, manifest;

  SmallRun() {
    const engine::Waterfall sample = sample_waterfall(3, 8);
    engine::Sonar sonar = sample.sonar;
    sonar.name = "left-right";
    engine::Waterfall waterfall(sonar, 3);
    waterfall.pixels = sample.pixels;
    waterfall.pings = sample.pings;
    image = as_text(written_bytes([&](const refine::WriteAt& write_at) {
      engine::encode_exr(waterfall, {.encoding = {.layers = {"intensity"}}}, write_at);
    }));
    table = engine::pings_csv(waterfall);
    manifest =
        nlohmann::json{{"scene", "version = 1\n[sonar.left-right]\nbins = 8\nrange_m = 16.5\n"},
                       {"files",
                        {{{"name", "left-right.exr"},
                          {"size_bytes", image.size()},
                          {"xxh128", engine::xxh128(std::string_view(image))}}}}}
            .dump();
  }
};

}  // namespace ensonify::tests
