// What a connection holds of what it received: counted among all, among its name's, and what waits
// for the rest of a large frame among the parts of such. For the
// thread of the connection.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "core/base/status.h"
#include "core/base/str_cat.h"
#include "server/net/byte_budget.h"
#include "server/net/connection/identity_limits.h"
#include "server/net/connection/large_parts.h"
#include "server/net/connection/shared_limits.h"

namespace atlas {

class HeldBytes {
 public:
  // Both outlive this.
  HeldBytes(SharedLimits& limits, const NetOptions& options)
      : all_(limits.held), large_(limits.large), options_(options) {}
  HeldBytes(const HeldBytes&) = delete;
  HeldBytes& operator=(const HeldBytes&) = delete;
  ~HeldBytes() { GiveBack(bytes_); }

  // Those that are there count by the name, too, and so do those to come. kResourceExhausted, as
  // for the next.
  Status CountByName(std::shared_ptr<IdentityAllowance> allowance) {
    if (!allowance->held().Take(bytes_)) {
      return TooMuch(allowance->held(), allowance->whose());
    }
    allowance_ = std::move(allowance);
    return {};
  }
  // Of requests in flight, now: the less, the more the others hold.
  std::size_t max_request_bytes() const {
    return std::clamp(all_.share_bytes(), options_.large_frame_bytes, options_.max_received_bytes);
  }
  Status Take(std::size_t bytes) {
    if (!all_.Take(bytes)) {
      return TooMuch(all_, "all");
    }
    if (allowance_ != nullptr && !allowance_->held().Take(bytes)) {
      all_.GiveBack(bytes);
      return TooMuch(allowance_->held(), allowance_->whose());
    }
    bytes_ += bytes;
    return {};
  }
  // As large as it may be, as long as it leaves an eighth of all for small ones.
  Status TakeLarge(std::size_t bytes) {
    if (all_.taken_bytes() + bytes > all_.max_bytes() - all_.max_bytes() / 8) {
      return TooMuch(all_, "all");
    }
    return Take(bytes);
  }
  // So much there is of a frame, and the rest is expected until `deadline`; Time::max(): it is
  // whole. Once others need the room more `make_room` is called, from any thread, with a lock held.
  // kResourceExhausted: there is no room.
  Status CountPart(std::size_t bytes,
                   LargeParts::Time deadline,
                   const std::function<void()>& make_room) {
    const std::size_t large_bytes = bytes > options_.large_frame_bytes ? bytes : 0;
    if (part_ == nullptr && large_bytes > 0) {
      part_ = std::make_unique<LargeParts::Part>(large_, make_room);
    }
    return part_ == nullptr || part_->Set(large_bytes, deadline) ? Status() : NoRoomForPart();
  }
  void DropPart() { part_.reset(); }
  Status NoRoomForPart() const {
    return {StatusCode::kResourceExhausted,
            StrCat("parts of large requests take ", large_.max_bytes(),
                   " bytes, and this one is the furthest behind; try again later")};
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
  LargeParts& large_;
  const NetOptions& options_;
  std::unique_ptr<LargeParts::Part> part_;        // from the first large frame on
  std::shared_ptr<IdentityAllowance> allowance_;  // of its name, if it has one
  std::size_t bytes_ = 0;
};

}  // namespace atlas
