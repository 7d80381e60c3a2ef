// The digest's input, tile by tile: SHA-256 over each tile's key (8 bytes big-endian), length (8
// bytes big-endian) and canonical uncompressed payload.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/tile_id.h"

struct evp_md_ctx_st;

namespace atlas {

class TileHasher {
 public:
  TileHasher();

  // In key order.
  void Add(const TileId& id, ByteSpan payload);
  std::uint64_t tiles() const { return tiles_; }
  // Once, at the end. kInternal when OpenSSL failed anywhere.
  Result<std::array<std::uint8_t, 32>> Finish();

 private:
  void AddBytes(ByteSpan bytes);
  void AddBigEndian(std::uint64_t value);

  std::unique_ptr<evp_md_ctx_st, void (*)(evp_md_ctx_st*)> context_;
  bool is_ok_ = false;
  std::uint64_t tiles_ = 0;
};

}  // namespace atlas
