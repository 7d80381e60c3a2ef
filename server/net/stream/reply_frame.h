// A frame of a reply on its way out: bytes of its own, or a tile's body that many replies share
// with those around it.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include "core/base/bytes.h"
#include "proto/wire/frame.h"
#include "proto/wire/tile_body.h"

namespace atlas {

class ReplyFrame {
 public:
  explicit ReplyFrame(Bytes whole) : own_(std::move(whole)) {}
  ReplyFrame(std::shared_ptr<const TileBody> tile, std::uint64_t request_id)
      : own_(tile->FrameAround(request_id)), tile_(std::move(tile)) {}

  std::size_t size() const { return own_.size() + (tile_ ? tile_->bytes().size() : 0); }

  // What goes out: head(), the tile's bytes if there is one, tail().
  ByteSpan head() const { return tile_ ? ByteSpan(own_).first(kFrameHeaderBytes) : own_; }
  const std::shared_ptr<const TileBody>& tile() const { return tile_; }
  ByteSpan tail() const { return tile_ ? ByteSpan(own_).subspan(kFrameHeaderBytes) : ByteSpan(); }
  // All of it, where there is no tile.
  Bytes TakeWhole() && { return std::move(own_); }

 private:
  Bytes own_;
  std::shared_ptr<const TileBody> tile_;
};

}  // namespace atlas
