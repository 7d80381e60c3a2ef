// SIGINT and SIGTERM as something to look at, for commands that have half of a result to remove.
// When it goes, a signal that came ends the process after all: whoever waits for it learns that.
#pragma once

#include <csignal>

#include "core/base/status.h"

namespace atlas {

// One at a time. Signals that are ignored stay so.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;
  Interruption(Interruption&&) = delete;
  Interruption& operator=(Interruption&&) = delete;

  // kUnavailable: a signal came.
  Status Check() const;

 private:
  struct sigaction interrupt_before_ {};
  struct sigaction terminate_before_ {};
};

}  // namespace atlas
