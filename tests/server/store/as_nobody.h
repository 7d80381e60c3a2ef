// Tests that files are read as somebody who may not write to them, whoever runs the test.
#pragma once

#include <cstdlib>
#include <stdexcept>

#include <unistd.h>

namespace atlas {

// The same rights as somebody who may not write; root has all of them otherwise.
class AsNobody {
 public:
  AsNobody() : is_root_(::geteuid() == 0) {
    if (is_root_ && ::seteuid(65'534) != 0) throw std::runtime_error("seteuid");
  }
  ~AsNobody() {
    if (is_root_ && ::seteuid(0) != 0) std::abort();
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;

 private:
  bool is_root_;
};

}  // namespace atlas
