// Whether threads and queues answer: each is asked to, and given a while.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/status.h"

namespace atlas {

// Something that lives as long as it answers.
struct Pulse {
  std::string name;
  // Has `answer` called by it, sooner or later; may outlive the Liveness.
  std::function<void(std::function<void()> answer)> ask;
};

class Liveness {
 public:
  Liveness(std::vector<Pulse> pulses, std::chrono::milliseconds patience);

  // kTimeout names those that did not answer in time. One that still owes an answer is not asked
  // again, so that questions do not pile up. From one thread.
  Status Check();

 private:
  struct Answer;
  struct Asked {
    Pulse pulse;
    std::shared_ptr<Answer> answer;
  };

  std::vector<Asked> all_;
  std::chrono::milliseconds patience_;
};

}  // namespace atlas
