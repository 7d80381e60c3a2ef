// A tile as every reply with it carries it, made once: what differs from reply to reply, the
// frame's header and the request's id, stands around it.
//
//   header (12 bytes) | field `tile` of the Envelope, blob and all | field `request_id`
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/bytes.h"
#include "core/base/hash.h"
#include "core/base/status.h"

namespace atlas {

struct TileBodyId {
  std::uint64_t key = 0;
  std::uint64_t revision = 0;
  std::uint64_t payload_hash = 0;
  std::uint64_t base_hash = 0;  // not 0: the blob is a delta to the content with this hash
};

class TileBody {
 public:
  // kInvalidArgument when that is more than a frame may hold.
  static Result<TileBody> Create(const TileBodyId& id, ByteSpan blob);

  const TileBodyId& id() const { return id_; }
  ByteSpan blob() const { return ByteSpan(bytes_).last(blob_bytes_); }
  ByteSpan bytes() const { return bytes_; }
  // Its header, then what follows bytes(): a frame is all three.
  Bytes FrameAround(std::uint64_t request_id) const;

 private:
  TileBody() = default;

  TileBodyId id_;
  std::size_t blob_bytes_ = 0;
  Bytes bytes_;
  Hash64Stream hash_;  // of these
};

}  // namespace atlas
