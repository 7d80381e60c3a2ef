// The addresses of a host. The system's resolver takes as long as it likes and cannot be told to
// stop: it is asked on a thread of its own, one question at a time, and whoever waits for the
// answer leaves at a deadline. A question outlives its asker: the next one for the same host hears
// the answer. One thread at a time.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"

namespace atlas {

class NameLookup {
 public:
  // Numeric ones, the best first, at least one.
  using Addresses = std::vector<std::string>;
  // Called on another thread, and may block. May outlive the lookup.
  using Resolver = std::function<Result<Addresses>(const std::string& host)>;

  // The system's (getaddrinfo): kUnavailable where it knows no address.
  static Result<Addresses> AskSystem(const std::string& host);

  explicit NameLookup(Resolver resolver = &AskSystem);

  // nullopt: not known at `latest`, the question goes on. A question for another host waits until
  // the one that is under way is answered. An address is its own answer, at once.
  Result<std::optional<Addresses>> Find(const std::string& host,
                                        std::chrono::steady_clock::time_point latest);

 private:
  struct Question;

  Status Ask(const std::string& host);

  Resolver resolver_;
  std::shared_ptr<Question> question_;  // its thread's, too
};

}  // namespace atlas
