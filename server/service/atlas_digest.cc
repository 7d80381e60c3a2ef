#include "server/service/atlas_digest.h"

#include <memory>

#include <openssl/evp.h>

#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 1'024;

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    is_ok_ = context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1;
  }
  void Add(ByteSpan bytes) {
    is_ok_ = is_ok_ && EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1;
  }
  void AddBigEndian(std::uint64_t value) {
    std::array<std::uint8_t, 8> bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<std::uint8_t>(value >> (56 - 8 * i));
    }
    Add(bytes);
  }
  // False when OpenSSL failed anywhere.
  bool Finish(std::array<std::uint8_t, 32>& digest) {
    unsigned size = 0;
    is_ok_ = is_ok_ && EVP_DigestFinal_ex(context_.get(), digest.data(), &size) == 1;
    return is_ok_ && size == digest.size();
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
  bool is_ok_ = false;
};

Status AddTile(AtlasStore& store, const TileId& id, Sha256& hash, std::uint64_t& tiles) {
  const auto tile = store.ReadTile(id);
  if (!tile) {
    return tile.error();
  }
  if (!*tile) {  // gone since it was listed
    return {};
  }
  const auto payload = TilePayloadFromBlob((*tile)->blob);
  if (!payload) {
    return payload.error().WithContext(StrCat("tile ", id));
  }
  hash.AddBigEndian(id.Key());
  hash.AddBigEndian(payload->size());
  hash.Add(*payload);
  ++tiles;
  return {};
}

}  // namespace

Result<AtlasDigest> ComputeDigest(AtlasStore& store, const std::function<Status()>& check_stop) {
  AtlasDigest digest;
  Sha256 hash;
  std::int64_t after = -1;
  while (true) {
    const auto page = store.ListTiles(after, kPage);
    if (!page) {
      return Error(page.error());
    }
    if (page->empty()) {
      break;
    }
    for (const TileSummary& tile : *page) {
      if (Status status = check_stop(); !status.ok()) {
        return Error(std::move(status));
      }
      if (Status status = AddTile(store, tile.id, hash, digest.tiles); !status.ok()) {
        return Error(std::move(status));
      }
    }
    after = static_cast<std::int64_t>(page->back().id.Key());
  }
  if (!hash.Finish(digest.sha256)) {
    return Error(StatusCode::kInternal, "digest: SHA-256 failed");
  }
  return digest;
}

}  // namespace atlas
