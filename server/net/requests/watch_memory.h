// What watches keep of the areas that they are about: so much of one connection's, of one name's,
// of all. Thread-safe, but for the budgets of connections.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "core/base/status.h"
#include "core/base/str_cat.h"
#include "server/net/byte_budget.h"
#include "server/net/peer_share.h"
#include "server/net/requests/freed_memory.h"

namespace atlas {

class WatchMemory {
 public:
  // `freed` outlives this.
  WatchMemory(std::size_t max_bytes, FreedMemory& freed) : all_(max_bytes), freed_(freed) {}

  // Taken until it is destroyed; both budgets outlive it. `share`: of its name, if it has one.
  // kResourceExhausted: there is no room.
  Result<std::shared_ptr<const void>> Take(std::size_t bytes,
                                           ByteBudget& own,
                                           std::shared_ptr<PeerShare> share) {
    if (!own.Take(bytes)) {
      return Error(Full(own, "this connection"));
    }
    if (share != nullptr && !share->watched.Take(bytes)) {
      own.GiveBack(bytes);
      return Error(Full(share->watched, share->whose));
    }
    const auto give_back = [&own, share = std::move(share), bytes] {
      own.GiveBack(bytes);
      if (share != nullptr) {
        share->watched.GiveBack(bytes);
      }
    };
    if (!all_.Take(bytes)) {
      give_back();
      return Error(Full(all_, "all connections"));
    }
    return std::shared_ptr<const void>(this, [this, give_back, bytes](const void*) {
      all_.GiveBack(bytes);
      give_back();
      freed_.Note(bytes);
    });
  }
  std::size_t taken_bytes() const { return all_.taken_bytes(); }

 private:
  static Status Full(const ByteBudget& budget, const std::string& whose) {
    return {StatusCode::kResourceExhausted,
            StrCat("watch: the areas of the watches of ", whose, " take ", budget.taken_bytes(),
                   " bytes, with this one more than ", budget.max_bytes(), "; try again later")};
  }

  ByteBudget all_;
  FreedMemory& freed_;
};

}  // namespace atlas
