#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

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

  /// The lines by number. A side that is silent, that is, 0 in every sample, is left out with a
  /// warning if the other one is not. Samples of a side that are longer in range than those of the
  /// other are repeated, so that sample k of both lies at the same range. Throws RecordingError if
  /// there is no line, or if a line's pings differ so much in length that its rows would take far
  /// more memory than its file.
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
  static void leave_out_silent_side(Entry& entry, std::string_view name);
  static void make_samples_alike(Entry& entry, std::string_view name);

  std::string format_;
  std::map<int, Entry> entries_;
  std::size_t skipped_bytes_ = 0;
  bool cut_off_ = false;
};

}  // namespace ensonify::engine
