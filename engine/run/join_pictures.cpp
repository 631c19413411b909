#include <ensonify/engine/run/join_pictures.h>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/output/png.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_rows = 30000;
constexpr std::uintmax_t most_picture_bytes = std::uintmax_t{1} << 30;

Picture picture_of(const fs::path& file) {
  const std::string content = refine::read_file(file, most_picture_bytes);
  try {
    return decode_png(std::as_bytes(std::span(content)));
  } catch (const std::runtime_error& error) {
    throw SceneError(fmt::format("{}: {}; remove the part's folder and run it again", file.string(),
                                 error.what()));
  }
}

/// Averages rows of pixels by groups.
class RowMeans {
 public:
  RowMeans(const PngFormat& format, std::size_t group, std::size_t first_group)
      : format_(format),
        group_(group),
        left_(first_group),
        sums_(format.width * static_cast<std::size_t>(format.channels)) {}

  /// Calls finished(row) whenever a group is complete.
  template <class Finished>
  void add(const std::uint8_t* row, Finished&& finished) {
    const bool wide = format_.bits == 16;
    for (std::size_t i = 0; i < sums_.size(); ++i)
      sums_[i] += wide ? 256u * row[2 * i] + row[2 * i + 1] : row[i];
    ++added_;
    if (--left_ > 0) return;
    std::vector<std::uint8_t> mean;
    for (std::uint64_t& sum : sums_) {
      const std::uint64_t value = (sum + added_ / 2) / added_;
      if (wide) mean.push_back(static_cast<std::uint8_t>(value >> 8));
      mean.push_back(static_cast<std::uint8_t>(value & 0xff));
      sum = 0;
    }
    added_ = 0;
    left_ = group_;
    finished(mean);
  }

 private:
  PngFormat format_;
  std::size_t group_, left_, added_ = 0;
  std::vector<std::uint64_t> sums_;
};

}  // namespace

std::size_t pings_per_row(std::size_t pings) { return (pings + max_rows - 1) / max_rows; }

void join_pictures(const fs::path& folder, const RunParts& parts, std::size_t finished_parts,
                   const std::string& sonar) {
  std::size_t beams = 0, rows = 0, group = 1;
  PngFormat first;  // of the part that is read first
  refine::NewFile file(folder / (sonar + ".png"));
  std::unique_ptr<PngWriter> writer;
  std::unique_ptr<RowMeans> means;
  // The newest ping is on top. Groups are counted from the oldest ping, so the first may be short.
  for (std::size_t part = finished_parts; part-- > 0;) {
    const fs::path its_file = folder / parts.file(part, sonar, ".png");
    const Picture picture = picture_of(its_file);
    if (!writer) {
      beams = picture.height / parts.range(part).count;
      first = {picture.width, picture.height, picture.channels, picture.bits};
    }
    if (beams == 0 || picture.height != beams * parts.range(part).count ||
        picture.width != first.width || picture.channels != first.channels ||
        picture.bits != first.bits)
      throw SceneError(
          fmt::format("{}: its size does not fit its pings and the other parts' pictures; remove "
                      "the part's folder and run it again",
                      its_file.string()));
    if (!writer) {
      rows = beams * parts.range(part).end();
      group = pings_per_row(beams * parts.pings());
      const PngFormat format{picture.width, (rows + group - 1) / group, picture.channels,
                             picture.bits};
      writer = std::make_unique<PngWriter>(
          format, [&](std::span<const std::byte> bytes) { file.write(bytes); });
      means = std::make_unique<RowMeans>(format, group, rows % group > 0 ? rows % group : group);
    }
    const std::size_t row_bytes = picture.pixels.size() / picture.height;
    for (std::size_t row = 0; row < picture.height; ++row)
      means->add(&picture.pixels[row * row_bytes],
                 [&](const std::vector<std::uint8_t>& mean) { writer->add_rows(mean); });
  }
  writer->finish();
  file.commit();
}

}  // namespace ensonify::engine
