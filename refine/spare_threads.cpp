#include <ensonify/refine/spare_threads.h>

namespace ensonify::refine {

void SpareThreads::BackgroundTask::send(SpareThreads& threads) {
  if (is_out() || !threads.any()) return;
  const std::lock_guard lock(threads.mutex_);
  if (!threads.any()) return;
  threads_ = &threads;
  state_ = State::offered;
  --threads.idle_;
  threads.offered_.push_back(this);
  threads.offered_or_over_.notify_one();
}

bool SpareThreads::BackgroundTask::finish() {
  // If the task is idle or done, its SpareThreads need not exist, so *threads_ must not be used.
  if (state_ == State::offered || state_ == State::running) {
    std::unique_lock lock(threads_->mutex_);
    if (state_ == State::offered) {
      std::erase(threads_->offered_, this);
      ++threads_->idle_;
      state_ = State::idle;
    }
    threads_->done_.wait(lock, [&] { return state_ != State::running; });
  }
  return state_.exchange(State::idle) == State::done;
}

void SpareThreads::begin_items() {
  const std::lock_guard lock(mutex_);
  ++at_items_;
}

void SpareThreads::serve() {
  std::unique_lock lock(mutex_);
  if (--at_items_ == 0) offered_or_over_.notify_all();
  ++idle_;
  offered_.reserve(offered_.capacity() + 1);  // so that push_back in send() never allocates
  while (true) {
    offered_or_over_.wait(lock, [&] { return !offered_.empty() || at_items_ == 0; });
    if (at_items_ == 0) break;
    BackgroundTask& task = *offered_.back();
    offered_.pop_back();
    task.state_ = BackgroundTask::State::running;
    lock.unlock();
    task.work_();
    lock.lock();
    task.state_ = BackgroundTask::State::done;
    ++idle_;
    done_.notify_all();
  }
  --idle_;
  // No thread is left that would do the offered tasks.
  for (BackgroundTask* task : offered_) task->state_ = BackgroundTask::State::idle;
  idle_ += static_cast<int>(offered_.size());
  offered_.clear();
}

}  // namespace ensonify::refine
