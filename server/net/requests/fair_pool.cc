#include "server/net/requests/fair_pool.h"

#include <boost/asio/post.hpp>

namespace atlas {

std::uint64_t FairPool::Post(Whose whose, Job job) {
  const std::lock_guard lock(mutex_);
  lines_[whose].waiting.push_back({++last_number_, std::move(job)});
  Settle(whose);
  StartNext();
  return last_number_;
}

bool FairPool::Cancel(Whose whose, std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  const auto line = lines_.find(whose);
  if (line == lines_.end()) {
    return false;
  }
  const bool was_waiting = std::erase_if(line->second.waiting, [number](const Waiting& waiting) {
                             return waiting.number == number;
                           }) > 0;
  Settle(whose);
  return was_waiting;
}

void FairPool::StartNext() {
  while (free_ > 0 && !turns_.empty()) {
    const Whose whose = turns_.front();
    turns_.pop_front();
    Line& line = lines_.at(whose);
    line.is_ready = false;
    if (!line.waiting.empty()) {  // else they were cancelled
      Job job = std::move(line.waiting.front().job);
      line.waiting.pop_front();
      Start(whose, std::move(job));
    }
    Settle(whose);
  }
}

void FairPool::Start(Whose whose, Job job) {
  ++lines_.at(whose).running;
  --free_;
  boost::asio::post(pool_, [this, whose, job = std::move(job)]() mutable {
    job();
    job = nullptr;
    const std::lock_guard lock(mutex_);
    Finish(whose);
  });
}

void FairPool::Finish(Whose whose) {
  --lines_.at(whose).running;
  ++free_;
  Settle(whose);
  StartNext();
}

// Its turn comes, behind the others', or it is forgotten when nothing of it is left.
void FairPool::Settle(Whose whose) {
  Line& line = lines_.at(whose);
  if (line.is_ready) {
    return;
  }
  if (!line.waiting.empty() && line.running < max_running_) {
    line.is_ready = true;
    turns_.push_back(whose);
  } else if (line.waiting.empty() && line.running == 0) {
    lines_.erase(whose);
  }
}

}  // namespace atlas
