// A resolver that answers when a test lets it, as one does whose name server is silent.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/connection/name_lookup.h"

namespace atlas {

class GatedResolver {
 public:
  ~GatedResolver() { Answer(Error(StatusCode::kUnavailable, "the test is over")); }
  GatedResolver() = default;
  GatedResolver(const GatedResolver&) = delete;
  GatedResolver& operator=(const GatedResolver&) = delete;
  GatedResolver(GatedResolver&&) = delete;
  GatedResolver& operator=(GatedResolver&&) = delete;

  // May outlive this.
  NameLookup::Resolver resolver() const {
    return [state = state_](const std::string& host) {
      std::unique_lock lock(state->mutex);
      state->asked.push_back(host);
      state->changed.wait(lock, [&state] { return state->answer.has_value(); });
      return *state->answer;
    };
  }
  // To all that asks and will ask.
  void Answer(Result<NameLookup::Addresses> answer) {
    const std::scoped_lock lock(state_->mutex);
    state_->answer = std::move(answer);
    state_->changed.notify_all();
  }
  std::vector<std::string> asked() const {
    const std::scoped_lock lock(state_->mutex);
    return state_->asked;
  }

 private:
  struct State {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<Result<NameLookup::Addresses>> answer;
    std::vector<std::string> asked;
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

}  // namespace atlas
