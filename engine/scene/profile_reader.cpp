#include <ensonify/engine/scene/profile_reader.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {
namespace {

constexpr std::uintmax_t largest_file_bytes = 4 << 20;
constexpr std::size_t longest_line = 4096;
constexpr std::array<std::string_view, 2> columns = {"depth_m", "soundspeed_mps"};
constexpr std::string_view expected = "a header row with depth_m,soundspeed_mps";

/// What somebody's file says, fit for a message: short and printable.
std::string quoted(std::string_view text) {
  std::string shown(text.substr(0, 40));
  for (char& c : shown)
    if (!std::isprint(static_cast<unsigned char>(c))) c = '?';
  return '\'' + shown + (text.size() > 40 ? "...'" : "'");
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view space = " \t\r";
  text.remove_prefix(std::min(text.find_first_not_of(space), text.size()));
  return text.substr(0, text.find_last_not_of(space) + 1);
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t comma = line.find(',');
    std::string_view field = trimmed(line.substr(0, comma));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
      field = trimmed(field.substr(1, field.size() - 2));
    fields.push_back(field);
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

class ProfileReader {
 public:
  ProfileReader(std::string_view text, std::string_view name) : text_(text), name_(name) {
    if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
  }

  scatter::SoundSpeedProfile read() {
    std::string_view line;
    if (!next_line(line)) fail(fmt::format("nothing is in it, expected {}", expected));
    read_header(line);
    std::vector<scatter::SoundSpeedSample> samples;
    while (next_line(line)) samples.push_back(sample(line));
    if (samples.empty()) fail("no sample follows the header row, expected at least one");
    return scatter::SoundSpeedProfile(std::move(samples));
  }

 private:
  [[noreturn]] void fail(std::string_view what) const {
    throw SceneError(fmt::format("{}:{}: {}", name_, std::max(line_, 1), what));
  }

  /// The next line that says something.
  bool next_line(std::string_view& line) {
    while (!text_.empty()) {
      const std::size_t end = std::min(text_.find('\n'), text_.size());
      line = trimmed(text_.substr(0, end));
      text_.remove_prefix(std::min(end + 1, text_.size()));
      ++line_;
      if (line.size() > longest_line)
        fail(fmt::format("a line of more than {} characters, expected a sample a line",
                         longest_line));
      if (!line.empty() && !line.starts_with('#')) return true;
    }
    return false;
  }

  void read_header(std::string_view line) {
    const std::vector<std::string_view> names = split(line);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto found = std::ranges::find(names, columns[i]);
      if (found == names.end())
        fail(fmt::format("no column {} in {}, expected {}", columns[i], quoted(line), expected));
      if (std::find(found + 1, names.end(), columns[i]) != names.end())
        fail(fmt::format("column {} is there twice, expected it once", columns[i]));
      place_[i] = static_cast<std::size_t>(found - names.begin());
    }
    fields_ = names.size();
  }

  scatter::SoundSpeedSample sample(std::string_view line) const {
    const std::vector<std::string_view> fields = split(line);
    if (fields.size() != fields_)
      fail(fmt::format("{} values in {}, expected {} as in the header row", fields.size(),
                       quoted(line), fields_));
    scatter::SoundSpeedSample sample;
    for (auto [value, i] : {std::pair{&sample.depth_m, 0}, {&sample.sound_speed_mps, 1}})
      *value = number(fields[place_[i]], columns[i]);
    try {
      scatter::check_sound_speed_sample(sample);
    } catch (const std::invalid_argument& error) {
      fail(error.what());
    }
    return sample;
  }

  double number(std::string_view field, std::string_view column) const {
    const std::string_view digits =
        field.starts_with('+') && !field.starts_with("+-") ? field.substr(1) : field;
    double value = 0.0;
    const char* end = digits.data() + digits.size();
    const auto read = std::from_chars(digits.data(), end, value);
    if (read.ec != std::errc() || read.ptr != end)
      fail(fmt::format("{} is {}, expected a number as in 12.5", column, quoted(field)));
    return value;
  }

  std::string_view text_;
  std::string_view name_;
  int line_ = 0;
  std::array<std::size_t, columns.size()> place_ = {};  // of the columns among the fields
  std::size_t fields_ = 0;
};

}  // namespace

scatter::SoundSpeedProfile parse_profile(std::string_view text, std::string_view name) {
  return ProfileReader(text, name).read();
}

scatter::SoundSpeedProfile read_profile(const std::filesystem::path& file) {
  const auto fail = [&](std::string_view what) {
    throw SceneError(fmt::format("{}: {}", file.string(), what));
  };
  // Before it is opened: a named pipe would wait for ever.
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(file, unknown))
    fail("is not a file that can be read; correct the path");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) fail("cannot be opened; check its permissions");
  if (const auto bytes = std::filesystem::file_size(file, unknown); bytes > largest_file_bytes)
    fail(fmt::format("has {} bytes, expected at most {}; thin the cast out", bytes,
                     largest_file_bytes));
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) fail("cannot be read to its end; check the disk");
  return parse_profile(text, file.string());
}

}  // namespace ensonify::engine
