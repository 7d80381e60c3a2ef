// What a connection holds of what it received: counted among all, and among its name's. For the
// thread of the connection.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "core/base/status.h"
#include "core/base/str_cat.h"
#include "server/net/byte_budget.h"
#include "server/net/connection/identity_limits.h"

namespace atlas {

class HeldBytes {
 public:
  // `all` outlives this.
  explicit HeldBytes(ByteBudget& all) : all_(all) {}
  HeldBytes(const HeldBytes&) = delete;
  HeldBytes& operator=(const HeldBytes&) = delete;
  ~HeldBytes() { GiveBack(bytes_); }

  // Those that are there count by the name, too, and so do those to come. kResourceExhausted, as
  // for the next.
  Status CountByName(std::shared_ptr<IdentityAllowance> allowance, const std::string& name) {
    if (!allowance->held().Take(bytes_)) {
      return TooMuch(allowance->held(), name);
    }
    allowance_ = std::move(allowance);
    name_ = name;
    return {};
  }
  Status Take(std::size_t bytes) {
    if (!all_.Take(bytes)) {
      return TooMuch(all_, "all");
    }
    if (allowance_ != nullptr && !allowance_->held().Take(bytes)) {
      all_.GiveBack(bytes);
      return TooMuch(allowance_->held(), name_);
    }
    bytes_ += bytes;
    return {};
  }
  void GiveBack(std::size_t bytes) {
    all_.GiveBack(bytes);
    if (allowance_ != nullptr) {
      allowance_->held().GiveBack(bytes);
    }
    bytes_ -= bytes;
  }
  std::size_t bytes() const { return bytes_; }

 private:
  static Status TooMuch(const ByteBudget& budget, const std::string& whose) {
    return {StatusCode::kResourceExhausted,
            StrCat("the daemon holds ", budget.max_bytes(), " bytes of requests of ", whose,
                   " already; try again later")};
  }

  ByteBudget& all_;
  std::shared_ptr<IdentityAllowance> allowance_;  // of its name, if it has one
  std::string name_;
  std::size_t bytes_ = 0;
};

}  // namespace atlas
