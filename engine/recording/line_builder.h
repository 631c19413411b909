#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// A warning of pings with an impossible value; `what` is, for example, "heading; it is left out",
/// `first` the number of the first of them.
std::string impossible_value(std::string_view name, std::size_t pings, std::string_view what,
                             std::uint64_t first, std::string_view value);

/// Collects the pings of a recording's lines, whatever their lengths.
class LineBuilder {
 public:
  explicit LineBuilder(std::string format) : format_(std::move(format)) {}

  /// The line of this number, for its facts.
  RecordedLine& line(int number);
  /// Adds one side of a ping, near to far. It belongs to the newest ping of the line if that has
  /// the same number and no such side yet.
  void add(int line, const RecordedPing& ping, Side side, std::vector<float> samples);
  void skipped(std::size_t bytes) { skipped_bytes_ += bytes; }
  void cut_off() { cut_off_ = true; }
  /// Counts a ping that states an impossible value, for a warning (impossible_value()). Several
  /// packets may have the ping's number.
  void impossible(const std::string& what, std::uint64_t ping, std::string_view value);
  /// Counts what is no sidescan ping, for the message about a file that has nothing else.
  void other(const std::string& what, std::size_t count = 1) { others_[what] += count; }
  /// The same of navigation that is not read: lines without places get a warning.
  void other_navigation(const std::string& what) {
    other(what);
    navigation_.insert(what);
  }

  /// The lines by number. A side that is silent, that is, 0 in every sample, is left out with a
  /// warning if the other one is not. Samples of a side that are longer in range than those of the
  /// other are repeated, so that sample k of both lies at the same range. Throws RecordingError if
  /// there is no line, with what the file has instead, or if a line's pings differ so much in
  /// length that its rows would take far more memory than its file.
  std::vector<RecordedLine> finish(std::string_view name);

 private:
  struct Sides {
    std::vector<float> port, starboard;
    double port_sample_m = 0.0, starboard_sample_m = 0.0;  // 0: not stated
  };
  struct Entry {
    RecordedLine line;
    std::vector<Sides> sides;  // by ping
  };
  /// Pings with an impossible value.
  struct Impossible {
    std::size_t pings = 0;
    std::uint64_t first = 0, last = 0;  // their numbers
    std::string value;                  // of the first
  };
  /// Those of others_ that `is_one` chooses, with their counts.
  template <class IsOne>
  std::string list_of_others(IsOne&& is_one) const;
  static void leave_out_silent_side(Entry& entry, std::string_view name);
  static void make_samples_alike(Entry& entry, std::string_view name);

  std::string format_;
  std::map<int, Entry> entries_;
  std::map<std::string, Impossible> impossible_;  // by what
  std::map<std::string, std::size_t> others_;     // by what
  std::set<std::string> navigation_;              // among them
  std::size_t skipped_bytes_ = 0;
  bool cut_off_ = false;
};

}  // namespace ensonify::engine
