#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace ensonify::engine {

/// The bytes of one frame (frames.h), shared by all pages.
using Bytes = std::shared_ptr<const std::string>;

/// The truth of one bin. The page shows it when the user points at the bin.
struct BinTruth {
  float x_m = 0.0f, y_m = 0.0f, z_m = 0.0f;  ///< local metres
  float grazing_rad = 0.0f;
  std::uint16_t sediment = 0, class_id = 0, instance = 0, shadow_instance = 0;
  std::uint8_t region = 0;
};

/// One line of one sonar. It is published, so it must not change.
struct LiveLine {
  std::uint64_t number = 0;  ///< counts the lines of all sonars from 0
  Bytes setting;             ///< the setting frame that was valid when the line was made
  Bytes frame;
  std::vector<BinTruth> truth;  ///< by column
  std::shared_ptr<const std::vector<std::string>> classes,
      materials;  ///< names, by the numbers in `truth`
  std::chrono::steady_clock::time_point published{};

  std::size_t bytes() const { return frame->size() + truth.size() * sizeof(BinTruth); }
};

/// Kinds of frames of which a page needs only the newest one. (For older lines a page also needs
/// their setting.) A setting is posted before its lines.
enum class LatestFrame { bed, mesh, status, setting };
inline constexpr std::size_t news_kinds = 4;

/// The newest lines. The oldest lines are dropped when all together exceed the memory limit. One
/// thread writes and never waits for a reader; any number of threads read, each at its own pace.
class LineRing {
 public:
  explicit LineRing(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Publishes the next line and sets its time.
  void push(std::shared_ptr<LiveLine> line);
  void post(LatestFrame kind, Bytes frame);
  void close();  ///< ends the waiting of all readers
  bool closed() const;

  /// The line with this number; null if it does not exist or was dropped.
  std::shared_ptr<const LiveLine> line(std::uint64_t number) const;

 private:
  friend class LineReader;
  mutable std::mutex lock_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<const LiveLine>> lines_;
  std::array<Bytes, news_kinds> news_;
  std::size_t bytes_ = 0, max_bytes_;
  std::uint64_t next_ = 0;
  bool closed_ = false;
};

/// Reads a ring for one page: first all lines in the ring, then new lines. A reader that has once
/// read all lines may later fall behind. If its next line is older than max_behind or was dropped,
/// it continues with the newest line, after a gap frame with the number of missed lines.
class LineReader {
 public:
  static constexpr std::chrono::seconds max_behind{3};

  LineReader(LineRing& ring, bool with_mesh) : ring_(ring), with_mesh_(with_mesh) {}

  /// The next frames; waits for them at most `wait`. Empty after that, or if the ring is closed.
  std::vector<Bytes> next(std::chrono::milliseconds wait);

 private:
  bool has_news() const;

  LineRing& ring_;
  bool with_mesh_;
  bool up_to_date_ = false;
  std::uint64_t next_ = 0;
  std::array<Bytes, news_kinds> seen_;
};

}  // namespace ensonify::engine
