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

/// A warning that `pings` pings of the file `name` state an impossible value. `what` is, for
/// example, "heading; it is left out". The first such ping has the number `first` and the value
/// `value`.
std::string impossible_value(std::string_view name, std::size_t pings, std::string_view what,
                             std::uint64_t first, std::string_view value);

/// Collects the pings of all lines of a recording. The pings may differ in length.
class LineBuilder {
 public:
  explicit LineBuilder(std::string format) : format_(std::move(format)) {}

  /// The line with this number. The reader sets its members that are the same for all pings.
  RecordedLine& line(int number) { return entries_[number].line; }
  /// Adds the samples of one side of a ping, from near to far. They belong to the newest ping of
  /// the line if it has the same number and lacks this side; otherwise `ping` becomes the newest
  /// ping.
  void add(int line, const RecordedPing& ping, Side side, std::vector<float> samples);
  void skipped(std::size_t bytes) { skipped_bytes_ += bytes; }
  void cut_off() { cut_off_ = true; }
  /// Counts a ping that states an impossible value, for a warning (impossible_value()). Consecutive
  /// packets with the same ping number count once.
  void impossible(const std::string& what, std::uint64_t ping, std::string_view value);
  /// Counts packets without sidescan pings, for the error about a file that has no others.
  void other(const std::string& what, std::size_t count = 1) { others_[what] += count; }
  /// As other(), for navigation, which is not read; lines without places get a warning about it.
  void other_navigation(const std::string& what) {
    other(what);
    navigation_.insert(what);
  }

  /// The lines in the order of their numbers; call this once. If only one side of a line is 0 in
  /// every sample, this side is left out with a warning. If the samples of one side are longer in
  /// range than those of the other side, the longer samples are repeated, so that sample k of both
  /// sides lies at the same range. Throws RecordingError if there is no line; the message lists
  /// what the file has instead. Throws RecordingError if the pings of a line differ so much in
  /// length that the line would take far more memory than its file.
  std::vector<RecordedLine> finish(std::string_view name);

 private:
  struct Sides {
    std::vector<float> port, starboard;
    double port_sample_m = 0.0, starboard_sample_m = 0.0;  // length in range; 0: not stated
  };
  struct Entry {
    RecordedLine line;
    std::vector<Sides> sides;  // by ping
  };
  /// Pings with an impossible value.
  struct Impossible {
    std::size_t pings = 0;
    std::uint64_t first = 0, last = 0;  // numbers of these pings
    std::string value;                  // of the first ping
  };
  /// A text with the kinds in others_ for which is_one(kind) holds, and their counts.
  template <class IsOne>
  std::string list_of_others(IsOne&& is_one) const;
  static void leave_out_silent_side(Entry& entry, std::string_view name);
  static void make_samples_alike(Entry& entry, std::string_view name);

  std::string format_;
  std::map<int, Entry> entries_;
  std::map<std::string, Impossible> impossible_;  // by the parameter `what` of impossible()
  std::map<std::string, std::size_t> others_;     // counts, by the parameter `what` of other()
  std::set<std::string> navigation_;              // the kinds in others_ that are navigation
  std::size_t skipped_bytes_ = 0;
  bool cut_off_ = false;
};

}  // namespace ensonify::engine
