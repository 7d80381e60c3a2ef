#include "server/net/requests/reply_tiles.h"

#include <utility>

#include "core/tile/tile_container.h"
#include "core/tile/tile_delta.h"

namespace atlas {
namespace {

using Body = ReplyTiles::Body;

// What is saved is worth the work of putting the tile together.
bool IsWorthIt(std::size_t delta_bytes, std::size_t whole_bytes) {
  return delta_bytes + delta_bytes / 8 < whole_bytes;
}

Result<Body> MakeBody(const TileBodyId& id, ByteSpan blob) {
  Result<TileBody> made = TileBody::Create(id, blob);
  if (!made) {
    return Error(made.error());
  }
  return std::make_shared<const TileBody>(*std::move(made));
}

}  // namespace

Result<std::optional<Body>> ReplyTiles::Find(const SyncRequest& request,
                                             const SyncItem& item,
                                             bool takes_deltas,
                                             bool may_block) {
  const std::uint64_t key = item.tile.id.Key();
  TileFrames::Content content{key, item.tile.payload_hash, item.sections};
  const bool is_for_delta = takes_deltas && item.held_hash != 0;
  if (is_for_delta) {
    content.base_hash = item.held_hash;
    content.base_sections = item.held_sections;
    if (Body best = FindReady(content, item.tile.revision)) {
      return best;
    }
  }
  Body whole = FindReady({key, item.tile.payload_hash, item.sections}, item.tile.revision);
  const Body base = is_for_delta ? FindBase(item, request.sections) : nullptr;
  if (!may_block && (whole == nullptr || base != nullptr)) {
    return std::nullopt;
  }
  if (whole == nullptr) {
    Result<Body> read = Read(request, item);
    if (!read) {
      return Error(read.error());
    }
    whole = *std::move(read);
  }
  const bool is_as_planned = whole != nullptr && whole->id().payload_hash == item.tile.payload_hash;
  if (base == nullptr || !is_as_planned) {
    return whole;
  }
  Result<Body> best = MakeBest(content, *base, whole);
  if (!best) {
    return Error(best.error());
  }
  return *std::move(best);
}

Body ReplyTiles::FindReady(const TileFrames::Content& content, std::uint64_t revision) {
  Body body = frames_.Find(content);
  return body != nullptr && body->id().revision == revision ? body : nullptr;
}

// With whatever sections it was sent.
Body ReplyTiles::FindBase(const SyncItem& item, SectionMask wanted) {
  for (const SectionMask sections : {wanted, item.held_sections, kAllSections}) {
    if (Body base = frames_.Find({item.tile.id.Key(), item.held_hash, sections})) {
      return base;
    }
  }
  return nullptr;
}

// With the sections that are to be sent.
Result<Body> ReplyTiles::Read(const SyncRequest& request, const SyncItem& item) {
  Result<std::optional<StoredTile>> read = service_.ReadTile(item.tile.id);
  if (!read && read.error().code() == StatusCode::kInvalidData) {
    return nullptr;
  }
  if (!read) {
    return Error(read.error());
  }
  if (!*read) {
    return nullptr;
  }
  StoredTile& tile = **read;
  // Of other content than was planned nothing is held.
  const SectionMask sections =
      tile.payload_hash == item.tile.payload_hash ? item.sections : request.sections;
  if (sections != kAllSections) {
    Result<Bytes> blob = SelectSections(tile.blob, sections);
    if (!blob) {
      return Error(blob.error());
    }
    tile.blob = *std::move(blob);
  }
  Result<Body> body = MakeBody({tile.id.Key(), tile.revision, tile.payload_hash, 0}, tile.blob);
  if (body) {
    frames_.Insert({tile.id.Key(), tile.payload_hash, sections}, *body);
  }
  return body;
}

// The delta or the whole, whichever is better, kept for the next one who holds the same.
Result<Body> ReplyTiles::MakeBest(const TileFrames::Content& content,
                                  const TileBody& base,
                                  const Body& whole) {
  const Result<Bytes> held = SelectSections(base.blob(), content.base_sections);
  if (!held) {
    return Error(held.error());
  }
  const Result<Bytes> delta = EncodeTileDelta(*held, whole->blob());
  if (!delta) {
    return Error(delta.error());
  }
  Body best = whole;
  if (IsWorthIt(delta->size(), whole->blob().size())) {
    TileBodyId id = whole->id();
    id.base_hash = content.base_hash;
    Result<Body> made = MakeBody(id, *delta);
    if (!made) {
      return Error(made.error());
    }
    best = *std::move(made);
  }
  frames_.Insert(content, best);
  return best;
}

}  // namespace atlas
