#include "server/store/tile_hasher.h"

#include <openssl/evp.h>

namespace atlas {

TileHasher::TileHasher() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
  is_ok_ = context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1;
}

void TileHasher::Add(const TileId& id, ByteSpan payload) {
  AddBigEndian(id.Key());
  AddBigEndian(payload.size());
  AddBytes(payload);
  ++tiles_;
}

Result<std::array<std::uint8_t, 32>> TileHasher::Finish() {
  std::array<std::uint8_t, 32> digest{};
  unsigned size = 0;
  is_ok_ = is_ok_ && EVP_DigestFinal_ex(context_.get(), digest.data(), &size) == 1;
  if (!is_ok_ || size != digest.size()) {
    return Error(StatusCode::kInternal, "digest: SHA-256 failed");
  }
  return digest;
}

void TileHasher::AddBytes(ByteSpan bytes) {
  is_ok_ = is_ok_ && EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1;
}

void TileHasher::AddBigEndian(std::uint64_t value) {
  std::array<std::uint8_t, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(value >> (56 - 8 * i));
  }
  AddBytes(bytes);
}

}  // namespace atlas
