#include <ensonify/refine/mesh_formats.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

#include <fmt/format.h>

namespace ensonify::refine {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
bool is_line_end(char c) { return c == '\n' || c == '\r'; }

std::string_view without_plus(std::string_view word) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
  return plus ? word.substr(1) : word;
}

/// Reads a word as a number (or nan, inf); too small becomes 0, too large inf.
std::optional<double> to_number(std::string_view word) {
  word = without_plus(word);
  double value = 0.0;
  const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
  if (read.ptr != word.data() + word.size()) return std::nullopt;
  if (read.ec == std::errc::result_out_of_range)
    return word.find("e-") != word.npos || word.find("E-") != word.npos ? 0.0 : HUGE_VAL;
  if (read.ec != std::errc{}) return std::nullopt;
  return value;
}

}  // namespace

std::string quoted(std::string_view text) {
  std::string shown(text.substr(0, 60));
  for (char& c : shown)
    if (c < ' ' || c > '~') c = '?';
  return '"' + shown + (text.size() > 60 ? "...\"" : "\"");
}

void fail_at_byte(std::string_view name, std::size_t byte, const std::string& what) {
  throw MeshError(fmt::format("{}: byte {}: {}", name, byte, what));
}

std::string index_fault(std::int64_t index, std::uint64_t vertices) {
  return fmt::format("a face names vertex {}, but there are {}; correct the face or the vertices",
                     index, vertices);
}

MeshText::MeshText(std::string_view bytes, std::string_view name, Rules rules)
    : bytes_(bytes), name_(name), rules_(rules) {
  if (bytes.starts_with("\xef\xbb\xbf")) place_ = 3;
}

std::size_t MeshText::line_end_bytes(std::size_t place) const {
  if (place >= bytes_.size() || !is_line_end(bytes_[place])) return 0;
  return bytes_.substr(place, 2) == "\r\n" ? 2 : 1;
}

/// The length of a backslash here and the line end after it, if it joins two lines; otherwise 0.
std::size_t MeshText::joint_bytes() const {
  if (!rules_.joined_lines || bytes_[place_] != '\\') return 0;
  std::size_t place = place_ + 1;
  while (place < bytes_.size() && is_blank(bytes_[place])) ++place;
  const std::size_t end = line_end_bytes(place);
  return end == 0 ? 0 : place + end - place_;
}

std::string_view MeshText::word() {
  while (place_ < bytes_.size()) {
    if (const std::size_t joint = joint_bytes(); joint > 0) {
      place_ += joint;
      ++line_;
    } else if (is_blank(bytes_[place_])) {
      ++place_;
    } else {
      break;
    }
  }
  if (rules_.hash_comments && place_ < bytes_.size() && bytes_[place_] == '#')
    while (place_ < bytes_.size() && !is_line_end(bytes_[place_])) ++place_;
  const std::size_t first = place_;
  while (place_ < bytes_.size() && !is_blank(bytes_[place_]) && !is_line_end(bytes_[place_]) &&
         !(rules_.hash_comments && bytes_[place_] == '#') && joint_bytes() == 0)
    ++place_;
  return bytes_.substr(first, place_ - first);
}

bool MeshText::to_word() {
  for (;;) {
    if (const std::string_view found = word(); !found.empty()) {
      place_ -= found.size();
      return true;
    }
    const std::size_t end = line_end_bytes(place_);
    if (end == 0) return false;
    place_ += end;
    ++line_;
  }
}

std::string_view MeshText::next_word(std::string_view wanted) {
  if (const std::string_view found = word(); !found.empty()) return found;
  if (!to_word())
    fail(fmt::format("the file ends where {} should be; it is cut short: fetch or write it again",
                     wanted));
  return word();
}

void MeshText::end_line(std::string_view after) {
  if (const std::string_view found = word(); !found.empty())
    fail(fmt::format("{} follows {}; remove it, or correct what is before it", quoted(found),
                     after));
}

void MeshText::skip_line() {
  while (!word().empty()) {
  }
}

double MeshText::coordinate() { return coordinate(next_word("a coordinate")); }

std::int64_t MeshText::integer(std::string_view wanted) {
  return integer(next_word(wanted), wanted);
}

void MeshText::skip_number() { check_number(next_word("a number")); }

double MeshText::coordinate(std::string_view word) const {
  const std::optional<double> value = to_number(word);
  if (!value) fail(fmt::format("found {}, expected a number; correct it", quoted(word)));
  if (!(std::abs(*value) <= largest_mesh_m))
    fail(fmt::format("a coordinate is {}, not a number of metres; correct it", quoted(word)));
  return *value;
}

std::int64_t MeshText::integer(std::string_view word, std::string_view wanted) const {
  const std::string_view digits = without_plus(word);
  std::int64_t value = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (read.ec != std::errc{} || read.ptr != digits.data() + digits.size())
    fail(fmt::format("found {}, expected {}; correct it", quoted(word), wanted));
  return value;
}

void MeshText::check_number(std::string_view word) const {
  if (!to_number(word)) fail(fmt::format("found {}, expected a number; correct it", quoted(word)));
}

void MeshText::fail(const std::string& what, std::size_t line) const {
  throw MeshError(fmt::format("{}:{}: {}", name_, line, what));
}

}  // namespace ensonify::refine
