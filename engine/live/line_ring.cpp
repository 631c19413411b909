#include <ensonify/engine/live/line_ring.h>

#include <algorithm>

#include <ensonify/engine/live/frames.h>

namespace ensonify::engine {

void LineRing::push(std::shared_ptr<LiveLine> line) {
  std::vector<std::shared_ptr<const LiveLine>> old;  // freed after the lock is released
  {
    const std::lock_guard held(lock_);
    next_ = line->number + 1;
    line->published = std::chrono::steady_clock::now();
    bytes_ += line->bytes();
    lines_.push_back(std::move(line));
    while (bytes_ > max_bytes_ && lines_.size() > 1) {
      bytes_ -= lines_.front()->bytes();
      old.push_back(std::move(lines_.front()));
      lines_.pop_front();
    }
  }
  changed_.notify_all();
}

void LineRing::post(LatestFrame kind, Bytes frame) {
  {
    const std::lock_guard held(lock_);
    news_[static_cast<std::size_t>(kind)] = std::move(frame);
  }
  changed_.notify_all();
}

void LineRing::close() {
  {
    const std::lock_guard held(lock_);
    closed_ = true;
  }
  changed_.notify_all();
}

bool LineRing::closed() const {
  const std::lock_guard held(lock_);
  return closed_;
}

std::shared_ptr<const LiveLine> LineRing::line(std::uint64_t number) const {
  const std::lock_guard held(lock_);
  const std::uint64_t first = next_ - lines_.size();
  if (number < first || number >= next_) return nullptr;
  return lines_[number - first];
}

bool LineReader::has_news() const {
  if (next_ < ring_.next_) return true;
  for (std::size_t kind = 0; kind < news_kinds; ++kind)
    if (ring_.news_[kind] != seen_[kind] && (with_mesh_ || kind != std::size_t(LatestFrame::mesh)))
      return true;
  return false;
}

std::vector<Bytes> LineReader::next(std::chrono::milliseconds wait) {
  constexpr std::size_t max_bytes_at_once = 256 * 1024;
  std::vector<Bytes> frames;
  std::unique_lock held(ring_.lock_);
  ring_.changed_.wait_for(held, wait, [&] { return ring_.closed_ || has_news(); });
  if (ring_.closed_) return frames;
  const auto news = [&](LatestFrame kind) {
    const auto i = static_cast<std::size_t>(kind);
    if (seen_[i] == ring_.news_[i]) return;
    seen_[i] = ring_.news_[i];
    frames.push_back(seen_[i]);
  };
  news(LatestFrame::bed);
  const std::uint64_t first = ring_.next_ - ring_.lines_.size();
  const bool late =
      next_ < ring_.next_ && next_ >= first && up_to_date_ &&
      std::chrono::steady_clock::now() - ring_.lines_[next_ - first]->published > max_behind;
  if ((next_ < first && next_ > 0) || late) {
    frames.push_back(gap_frame(next_, ring_.next_ - 1 - next_));
    next_ = ring_.next_ - 1;
  }
  next_ = std::max(next_, first);  // without a gap frame: a new reader has missed nothing
  for (std::size_t bytes = 0; next_ < ring_.next_ && bytes < max_bytes_at_once; ++next_) {
    const LiveLine& line = *ring_.lines_[next_ - first];
    Bytes& setting = seen_[static_cast<std::size_t>(LatestFrame::setting)];
    if (line.setting != setting) frames.push_back(setting = line.setting);
    frames.push_back(line.frame);
    bytes += line.frame->size();
  }
  if (next_ == ring_.next_) {
    up_to_date_ = true;
    news(LatestFrame::setting);  // also if no line has this setting yet
  }
  if (with_mesh_) news(LatestFrame::mesh);
  news(LatestFrame::status);
  return frames;
}

}  // namespace ensonify::engine
