#include <fmt/format.h>

#include <ensonify/engine/trace/intersector.h>

#include "app.h"

namespace ensonify::engine::app {

void add_intersectors(CLI::App& app, Action& action) {
  app.add_subcommand("intersectors", "List the intersectors, which find the nearest hits of rays")
      ->callback([&action] {
        action = [] {
          std::string out;
          for (const IntersectorKind& kind : intersector_kinds())
            out += fmt::format("{:<14}{}\n", kind.name, kind.help);
          print(out);
        };
      });
}

}  // namespace ensonify::engine::app
