// What all connections together may hold of requests, so that many peers cannot fill the memory
// that each of them alone may not. For the network thread.
#pragma once

#include <cassert>
#include <cstddef>

namespace atlas {

class ByteBudget {
 public:
  explicit ByteBudget(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // False, and nothing taken, when that is more than is left.
  bool Take(std::size_t bytes) {
    if (bytes > max_bytes_ - taken_bytes_) {
      return false;
    }
    taken_bytes_ += bytes;
    return true;
  }
  void GiveBack(std::size_t bytes) {
    assert(bytes <= taken_bytes_);
    taken_bytes_ -= bytes;
  }

 private:
  std::size_t max_bytes_;
  std::size_t taken_bytes_ = 0;
};

}  // namespace atlas
