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

/// Bytes that all pages share, a whole frame (frames.h).
using Bytes = std::shared_ptr<const std::string>;

/// What is known of one bin, for who points at it.
struct BinTruth {
  float x_m = 0.0f, y_m = 0.0f, z_m = 0.0f;  ///< local metres
  float grazing_rad = 0.0f;
  std::uint16_t sediment = 0, class_id = 0, instance = 0, shadow_instance = 0;
  std::uint8_t region = 0;
};

/// One line of one sonar as it is published: nothing in it changes any more.
struct LiveLine {
  std::uint64_t number = 0;  ///< counts from 0, all sonars' lines
  Bytes setting;             ///< the setting frame that it was made under
  Bytes frame;
  float bin_m = 0.0f;
  std::vector<BinTruth> truth;                                         ///< by column
  std::shared_ptr<const std::vector<std::string>> classes, materials;  ///< what its numbers mean
  std::chrono::steady_clock::time_point published{};

  std::size_t bytes() const { return frame->size() + truth.size() * sizeof(BinTruth); }
};

/// What is sent beside the lines, of which only the newest counts.
enum class LatestFrame { bed, mesh, status };
inline constexpr std::size_t news_kinds = 3;

/// The newest lines, of which the oldest fall off where they take more memory than they may. One
/// thread writes and never waits for a reader; any number read, each at its own pace.
class LineRing {
 public:
  explicit LineRing(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// The line of the next number. Gives it its time.
  void push(std::shared_ptr<LiveLine> line);
  void post(LatestFrame kind, Bytes frame);
  void close();  ///< readers wait no more
  bool closed() const;

  /// The line of that number; none if it is not there (any more).
  std::shared_ptr<const LiveLine> line(std::uint64_t number) const;
  std::uint64_t next_number() const;

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

/// One page's way through a ring: first all that is there, then what comes. Whoever has once been
/// up to date and falls behind by more than so much time, or out of the ring, goes on with the
/// newest line, and is told how many are missing.
class LineReader {
 public:
  static constexpr std::chrono::seconds max_behind{3};

  LineReader(LineRing& ring, bool with_mesh) : ring_(ring), with_mesh_(with_mesh) {}

  /// The next frames, once there are some; nothing after that time, or when the ring is closed.
  std::vector<Bytes> next(std::chrono::milliseconds wait);

 private:
  bool has_news() const;

  LineRing& ring_;
  bool with_mesh_;
  bool up_to_date_ = false;
  std::uint64_t next_ = 0;
  Bytes setting_;
  std::array<Bytes, news_kinds> seen_;
};

}  // namespace ensonify::engine
