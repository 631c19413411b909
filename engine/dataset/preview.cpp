#include <ensonify/engine/dataset/preview.h>

#include <algorithm>
#include <array>
#include <map>
#include <mutex>
#include <span>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/number_in.h>
#include <ensonify/engine/dataset/chips.h>
#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/image/fan_picture.h>
#include <ensonify/engine/image/lettering.h>
#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t line_px = letter_height_px + 1;
constexpr std::size_t panel_width = 380, max_height = 380, min_height = 60, border = 6, columns = 2;
constexpr Rgb paper{250, 250, 248}, ink{30, 30, 30}, water{18, 24, 48}, dark{0, 0, 0},
    no_data{90, 90, 90};
// Okabe & Ito's colours (Color Universal Design, 2008): colour-blind people can distinguish them.
constexpr auto bright =
    rgb_colours({0xe69f00, 0x56b4e9, 0x009e73, 0xf0e442, 0xd55e00, 0xcc79a7, 0x0072b2});
constexpr auto muted = rgb_colours({0xc4b28a, 0x968d74, 0x768680, 0xa896a0, 0x867860, 0xb0baac});

Picture blank(std::size_t width, std::size_t height, const Rgb& colour) {
  Picture picture{width, height, 3, {}};
  picture.pixels.reserve(3 * width * height);
  for (std::size_t i = 0; i < width * height; ++i)
    picture.pixels.insert(picture.pixels.end(), colour.begin(), colour.end());
  return picture;
}

void set(Picture& picture, std::size_t column, std::size_t row, const Rgb& colour) {
  if (column >= picture.width || row >= picture.height) return;
  std::copy(
      colour.begin(), colour.end(),
      picture.pixels.begin() + static_cast<std::ptrdiff_t>(3 * (row * picture.width + column)));
}

void paste(const Picture& from, Picture& to, std::size_t column, std::size_t row) {
  for (std::size_t y = 0; y < from.height; ++y)
    std::copy_n(
        from.pixels.begin() + static_cast<std::ptrdiff_t>(3 * y * from.width), 3 * from.width,
        to.pixels.begin() + static_cast<std::ptrdiff_t>(3 * ((row + y) * to.width + column)));
}

/// A smaller picture; each pixel is the mean of the pixels that it replaces. A channel has only 32
/// levels, which are enough and compress much better than 256.
Picture shrunk(const Picture& from, std::size_t width, std::size_t height) {
  Picture to{width, height, 3, {}};
  to.pixels.resize(3 * width * height);
  const auto channels = static_cast<std::size_t>(from.channels);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t x0 = x * from.width / width,
                        x1 = std::max(x0 + 1, (x + 1) * from.width / width);
      const std::size_t y0 = y * from.height / height,
                        y1 = std::max(y0 + 1, (y + 1) * from.height / height);
      for (std::size_t c = 0; c < 3; ++c) {
        std::size_t sum = 0;
        for (std::size_t v = y0; v < y1; ++v)
          for (std::size_t u = x0; u < x1; ++u)
            sum += from.pixels[(v * from.width + u) * channels + (channels == 3 ? c : 0)];
        to.pixels[3 * (y * width + x) + c] =
            static_cast<std::uint8_t>(sum / ((x1 - x0) * (y1 - y0)) & 0xf8);
      }
    }
  return to;
}

/// The colour of one of the names: the colours are used in the order of the names, again and again.
const Rgb& colour_for(std::span<const Rgb> colours, const std::vector<std::string>& names,
                      const std::string& name) {
  return colours[static_cast<std::size_t>(std::ranges::find(names, name) - names.begin()) %
                 colours.size()];
}

/// The labels as colours: objects by class; the bed by class, or by sediment if its class is
/// "seabed".
Picture label_picture(const Waterfall& line, const Seafloor& seafloor, const Recipe& recipe) {
  const std::vector<std::string> classes = recipe.class_names(),
                                 materials = recipe.material_names();
  Picture picture = blank(line.columns(), line.rows(), no_data);
  for (std::size_t i = 0; i < line.pixels.region.size(); ++i) {
    const std::size_t row = line.rows() - 1 - i / line.columns(), column = i % line.columns();
    const std::string& name = seafloor.classes[line.pixels.class_id[i]];
    switch (static_cast<Region>(line.pixels.region[i])) {
      case Region::no_data: break;
      case Region::water_column: set(picture, column, row, water); break;
      case Region::shadow: set(picture, column, row, dark); break;
      case Region::object: set(picture, column, row, colour_for(bright, classes, name)); break;
      case Region::seabed:
        set(picture, column, row,
            name == "seabed"
                ? colour_for(muted, materials, seafloor.materials[line.pixels.sediment[i]])
                : colour_for(bright, classes, name));
        break;
    }
  }
  return picture;
}

void draw_box(Picture& picture, std::array<std::size_t, 4> box, const Rgb& colour) {
  for (std::size_t x = box[0]; x <= box[2]; ++x)
    set(picture, x, box[1], colour), set(picture, x, box[3], colour);
  for (std::size_t y = box[1]; y <= box[3]; ++y)
    set(picture, box[0], y, colour), set(picture, box[2], y, colour);
}

/// A number with a decimal point is shortened to four digits; any other value stays unchanged.
std::string short_text(const std::string& value) {
  const auto number = number_in<double>(value);
  return number && value.find('.') != std::string::npos ? fmt::format("{:.4g}", *number) : value;
}

std::vector<std::string> caption(std::size_t number, const SampleScene& sample) {
  constexpr std::size_t width = (2 * panel_width + border) / letter_width_px;
  std::vector<std::string> lines{
      fmt::format("sample {}, {}, seafloor {}:", number, sample.split, sample.seafloor)};
  for (const auto& [key, value] : sample.drawn) {
    if (key.ends_with(".present")) continue;
    const std::string word = fmt::format(" {}={}", key, short_text(value));
    if (lines.size() == 3 && lines.back().size() + word.size() + 4 > width) {
      lines.back() += " ...";
      break;
    }
    if (lines.back().size() + word.size() > width) lines.emplace_back();
    lines.back() += word;
  }
  return lines;
}

/// What a cell shows of a sample.
struct Shown {
  LabelledImage image;
  std::vector<TargetRecord> targets;
  double height_per_width = 1.0;
};

/// The line of the sample's first sonar, or the fan of the middle ping of an imaging sonar.
Shown shown_of(const RunOutputs& outputs) {
  const Waterfall& line = outputs.lines.front();
  const double width_m = static_cast<double>(line.columns()) * line.sonar.bin_m();
  if (!line.sonar.steers())
    return {slant_view(line, {outputs.pictures.front()}), outputs.targets.front(),
            length_along_m(line) / width_m};
  const std::size_t pings = line.rows() / static_cast<std::size_t>(line.sonar.beams);
  const LabelledImage frame = frame_view(line, pings / 2, {outputs.pictures.front()});
  const FanPicture fan(line.sonar);
  Shown shown{fan_view(frame, fan), target_records(frame.labels, outputs.simulator.seafloor()),
              static_cast<double>(fan.height()) / static_cast<double>(fan.width())};
  const std::map<std::uint32_t, TargetOutlines> outlines = find_outlines(shown.image.labels);
  std::erase_if(shown.targets,
                [&](const auto& record) { return !outlines.contains(record.target.instance); });
  for (TargetRecord& record : shown.targets)
    static_cast<TargetOutlines&>(record.target) = outlines.at(record.target.instance);
  return shown;
}

Picture cell(const Recipe& recipe, std::size_t number, const SampleScene& sample,
             const RunOutputs& outputs) {
  const Seafloor& seafloor = outputs.simulator.seafloor();
  const auto [image, targets, height_per_width] = shown_of(outputs);
  const Waterfall& line = image.labels;
  const std::vector<std::string> classes = recipe.class_names();
  const auto height =
      std::clamp(static_cast<std::size_t>(panel_width * height_per_width), min_height, max_height);
  Picture left = shrunk(image.pictures.front(), panel_width, height);
  Picture right = shrunk(label_picture(line, seafloor, recipe), panel_width, height);
  const auto to_panel = [&](const Corner& corner) {
    return std::array{static_cast<std::size_t>(corner[0]) * panel_width / line.columns(),
                      static_cast<std::size_t>(corner[1]) * height / line.rows()};
  };
  for (const TargetRecord& record : targets) {
    // Features of the bed, such as furrows, have no boxes, because boxes would hide them.
    if (!record.is_object()) continue;
    const Outline& shown = shown_part(record.target);
    const std::string& name = record.class_name;
    const Rgb& colour = colour_for(bright, classes, name);
    const auto low = to_panel(shown.low), high = to_panel(shown.high);
    draw_box(left,
             {low[0] - std::min<std::size_t>(low[0], 2), low[1] - std::min<std::size_t>(low[1], 2),
              high[0] + 1, high[1] + 1},
             colour);
    write_text(left,
               std::min(high[0] + 4,
                        panel_width - letter_width_px * std::min<std::size_t>(name.size(), 20)),
               low[1] - std::min<std::size_t>(low[1], 2), 1, colour, name);
  }
  const std::vector<std::string> words = caption(number, sample);
  Picture all = blank(2 * panel_width + border, height + words.size() * line_px + 2, paper);
  paste(left, all, 0, 0);
  paste(right, all, panel_width + border, 0);
  for (std::size_t i = 0; i < words.size(); ++i)
    write_text(all, 0, height + 2 + i * line_px, 1, ink, words[i]);
  return all;
}

/// A strip with the names of the labels and their colours.
Picture legend(const Recipe& recipe, std::size_t width) {
  Picture strip = blank(width, letter_height_px + 2, paper);
  std::size_t column = 0;
  const auto add = [&](const std::string& name, const Rgb& colour) {
    for (std::size_t y = 0; y < letter_height_px; ++y)
      for (std::size_t x = 0; x < letter_height_px; ++x) set(strip, column + x, y, colour);
    write_text(strip, column + letter_height_px + 3, 0, 1, ink, name);
    column += letter_height_px + 12 + letter_width_px * name.size();
  };
  const std::vector<std::string> classes = recipe.class_names(),
                                 materials = recipe.material_names();
  for (const std::string& name : classes)
    if (name != "seabed") add(name, colour_for(bright, classes, name));
  for (const std::string& name : materials) add(name, colour_for(muted, materials, name));
  add("water", water);
  add("shadow", dark);
  return strip;
}

}  // namespace

ContactSheet preview(const Recipe& recipe, std::size_t samples, const PreviewControl& control) {
  samples = std::min(samples, recipe.samples());
  std::vector<Picture> cells(samples);
  std::mutex mutex;
  std::size_t done = 0;
  const int threads = refine::thread_count(control.threads);
  const MemoryLimit memory_each{
      control.memory.bytes /
      static_cast<double>(std::clamp<std::size_t>(samples, 1, static_cast<std::size_t>(threads)))};
  const auto draw = [&](std::size_t k) {
    // Evenly chosen. "k % step" is added because values of stratified keys repeat at even steps.
    const std::size_t step = recipe.samples() / samples, number = k * step + k % step;
    SampleScene sample = recipe.sample(number);
    sample.scene.output = {.exr = false, .fans = false};
    const std::filesystem::path folder = control.scratch / fmt::format("{:06}", number);
    const auto on_progress = [&](std::string_view, std::size_t, std::size_t) {
      const std::lock_guard lock(mutex);
      return !control.progress || control.progress(done, samples);
    };
    const auto on_outputs = [&](const RunOutputs& outputs) {
      cells[k] = cell(recipe, number, sample, outputs);
    };
    run(sample.scene, folder,
        {.threads = 1,
         .progress = on_progress,
         .cache = control.cache,
         .memory = memory_each,
         .growing_picture = false,
         .on_outputs = on_outputs});
    std::filesystem::remove_all(folder);
    const std::lock_guard lock(mutex);
    ++done;
  };
  try {
    refine::parallel_for(samples, threads, [&](std::size_t k, int) { draw(k); });
  } catch (const Stopped&) {
    std::erase_if(cells, [](const Picture& one) { return one.pixels.empty(); });
    if (cells.empty()) throw Stopped("stopped before a sample was finished; nothing was written");
    samples = cells.size();
  }
  const std::size_t cell_width = cells.front().width;
  const std::size_t width = columns * cell_width + (columns + 1) * border;
  const auto height_of_row = [&](std::size_t first) {
    std::size_t tallest = 0;
    for (std::size_t k = first; k < std::min(samples, first + columns); ++k)
      tallest = std::max(tallest, cells[k].height);
    return tallest + border;
  };
  std::size_t height = border;
  for (std::size_t k = 0; k < samples; k += columns) height += height_of_row(k);
  const Picture names = legend(recipe, width - 2 * border);
  Picture sheet = blank(width, height + names.height + border, paper);
  std::size_t row = border;
  paste(names, sheet, border, row);
  row += names.height + border;
  for (std::size_t k = 0; k < samples; ++k) {
    paste(cells[k], sheet, border + (k % columns) * (cell_width + border), row);
    if (k % columns == columns - 1) row += height_of_row(k + 1 - columns);
  }
  return {std::move(sheet), samples};
}

}  // namespace ensonify::engine
