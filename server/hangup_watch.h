// SIGHUP, on a thread of its own: what is done about it may read files.
#pragma once

#include <functional>
#include <memory>

namespace atlas {

class HangupWatch {
 public:
  // Calls it once for each signal from now on, or for several that come at once.
  explicit HangupWatch(std::function<void()> on_hangup);
  HangupWatch(const HangupWatch&) = delete;
  HangupWatch& operator=(const HangupWatch&) = delete;
  ~HangupWatch();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace atlas
