#include "client/cli/command_line/interruption.h"

#include "core/base/str_cat.h"

namespace atlas {
namespace {

volatile std::sig_atomic_t signal_that_came = 0;

void Note(int number) {
  signal_that_came = number;
}

void Catch(int number, struct sigaction& before) {
  struct sigaction action {};
  action.sa_handler = &Note;
  action.sa_flags = SA_RESTART;
  sigaction(number, nullptr, &before);
  if (before.sa_handler != SIG_IGN) sigaction(number, &action, nullptr);
}

}  // namespace

Interruption::Interruption() {
  signal_that_came = 0;
  Catch(SIGINT, interrupt_before_);
  Catch(SIGTERM, terminate_before_);
}

Interruption::~Interruption() {
  sigaction(SIGINT, &interrupt_before_, nullptr);
  sigaction(SIGTERM, &terminate_before_, nullptr);
  if (signal_that_came != 0) std::raise(signal_that_came);
}

Status Interruption::Check() const {
  const int number = signal_that_came;
  return number == 0 ? Status() : Status(StatusCode::kUnavailable, StrCat("signal ", number));
}

}  // namespace atlas
