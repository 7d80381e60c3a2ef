#include "client/connection/sync_exchange.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "client/connection/area_message.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxHeld = 65'536;  // tiles; blocks
constexpr int kBlockBits = 6;             // of a tile's key within its block
constexpr int kLevelShift = 58;           // of a tile's key

Status Refuse(const std::string& why) {
  return {StatusCode::kInvalidArgument, StrCat("sync: ", why)};
}

Status Wrong(const std::string& what) {
  return {StatusCode::kInvalidData, StrCat("sync: the daemon ", what)};
}

template <typename Numbers>
void SetSections(SectionBits sections, Numbers& out) {
  if (sections == kEverySection) return;
  for (std::uint32_t number = 0; number < 64; ++number) {
    if ((sections >> number & 1U) != 0) out.Add(number);
  }
}

Status SetHeld(const SyncQuery& query, wire::SyncRequest& out) {
  std::size_t tiles = 0;
  std::size_t blocks = 0;
  for (const HeldGroup& group : query.held) {
    if (group.sections == 0) return Refuse("held tiles without a section");
    wire::Held& held = *out.add_held();
    SetSections(group.sections, *held.mutable_sections());
    for (const HeldGroup::OneTile& tile : group.tiles) {
      held.add_keys(tile.id.Key());
      held.add_payload_hashes(tile.payload_hash);
    }
    for (const HeldGroup::Block& block : group.blocks) {
      held.add_blocks(block.block);
      held.add_masks(block.mask);
      held.add_digests(block.digest);
    }
    tiles += group.tiles.size();
    blocks += group.blocks.size();
  }
  return tiles <= kMaxHeld && blocks <= kMaxHeld
             ? Status()
             : Refuse(StrCat(tiles, " tiles and ", blocks, " blocks are held, expected at most ",
                             kMaxHeld, " of either"));
}

// What is held, to be asked by key.
class HeldIndex {
 public:
  explicit HeldIndex(const std::vector<HeldGroup>& held) {
    for (const HeldGroup& group : held) {
      for (const HeldGroup::OneTile& tile : group.tiles) {
        keys_.insert(tile.id.Key());
      }
      for (const HeldGroup::Block& block : group.blocks) {
        masks_[block.block] |= block.mask;
      }
      blocks_ += group.blocks.size();
    }
  }

  bool HasTile(std::uint64_t key) const {
    const auto block = masks_.find(key >> kBlockBits);
    return keys_.contains(key) ||
           (block != masks_.end() && (block->second >> (key & 63U) & 1U) != 0);
  }
  bool HasBlock(std::uint64_t block) const { return masks_.contains(block); }
  std::size_t tiles() const { return keys_.size(); }
  std::size_t blocks() const { return blocks_; }

 private:
  std::unordered_set<std::uint64_t> keys_;
  std::unordered_map<std::uint64_t, std::uint64_t> masks_;
  std::size_t blocks_ = 0;
};

// nullopt: bits that do not belong to anything held. Missing ones are not set.
std::optional<std::vector<bool>> BitsFromWire(const std::string& bytes, std::size_t count) {
  std::vector<bool> bits(count, false);
  for (std::size_t i = 0; i < 8 * bytes.size(); ++i) {
    const bool is_set = (static_cast<std::uint8_t>(bytes[i / 8]) >> (i % 8) & 1U) != 0;
    if (is_set && i >= count) return std::nullopt;
    if (is_set) bits[i] = true;
  }
  return bits;
}

}  // namespace

Result<wire::Envelope> SyncRequestOf(const SyncQuery& query) {
  wire::Envelope envelope;
  wire::SyncRequest& request = *envelope.mutable_sync_request();
  Status status = AreaToWire(query.area, *request.mutable_area());
  if (status.ok()) status = SetHeld(query, request);
  if (status.ok() && query.sections == 0) status = Refuse("no section is wanted");
  if (!status.ok()) return Error(std::move(status));
  request.set_finest_level(query.finest_level);
  request.set_coarsest_level(query.coarsest_level);
  SetSections(query.sections, *request.mutable_sections());
  request.set_budget_bytes(query.budget_bytes);
  request.set_timeout_ms(static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(query.timeout.count(), 0, INT64_C(0xFFFFFFFF))));
  request.set_wait_revision(query.wait_revision);
  request.set_cursor(BytesToWire(query.cursor));
  request.set_takes_deltas(query.takes_deltas);
  return envelope;
}

SyncExchange::SyncExchange(const SyncQuery& query) : query_(query) {}

Status SyncExchange::Count(std::uint64_t frame_bytes) {
  summary_.bytes += frame_bytes;
  return query_.budget_bytes == 0 || summary_.bytes <= query_.budget_bytes
             ? Status()
             : Wrong(StrCat("sent ", summary_.bytes, " bytes, a budget of ", query_.budget_bytes,
                            " was asked for"));
}

Status SyncExchange::CheckAllCame() const {
  return came_ == announced_.size()
             ? Status()
             : Wrong(StrCat("announced ", announced_.size(), " tiles and sent ", came_));
}

Status SyncExchange::OnManifest(const wire::SyncManifest& manifest, std::uint64_t frame_bytes) {
  ATLAS_RETURN_IF_ERROR(Count(frame_bytes));
  ATLAS_RETURN_IF_ERROR(CheckAllCame());
  if (!has_begun_) ATLAS_RETURN_IF_ERROR(TakeHoldings(manifest));
  has_begun_ = true;
  return Announce(manifest);
}

Status SyncExchange::Announce(const wire::SyncManifest& manifest) {
  const int count = manifest.keys_size();
  if (manifest.revisions_size() != count || manifest.payload_hashes_size() != count ||
      manifest.bytes_size() != count) {
    return Wrong("announced tiles without a revision, a hash or a size of each");
  }
  announced_.clear();
  came_ = 0;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t key = manifest.keys(i);
    const std::uint64_t level = key >> kLevelShift;
    const bool is_coarser = query_.coarsest_level != 0 && level > query_.coarsest_level;
    if (!TileId::FromKey(key) || level < query_.finest_level || is_coarser) {
      return Wrong(StrCat("announced a tile that was not asked for, key ", key));
    }
    announced_.push_back(
        {key, manifest.revisions(i), manifest.payload_hashes(i), manifest.bytes(i)});
  }
  return {};
}

Status SyncExchange::TakeHoldings(const wire::SyncManifest& manifest) {
  const HeldIndex held(query_.held);
  auto tiles = BitsFromWire(manifest.current_tiles(), held.tiles());
  auto blocks = BitsFromWire(manifest.current_blocks(), held.blocks());
  if (!tiles || !blocks) return Wrong("says of tiles that are not held that they are current");
  summary_.current_tiles = *std::move(tiles);
  summary_.current_blocks = *std::move(blocks);
  summary_.not_modified_tiles = manifest.not_modified();
  for (const std::uint64_t key : manifest.removed()) {
    const Result<TileId> id = TileId::FromKey(key);
    if (!id || !held.HasTile(key)) {
      return Wrong(StrCat("removed a tile that is not held, key ", key));
    }
    summary_.removed.push_back(*id);
  }
  for (const std::uint64_t block : manifest.differing_blocks()) {
    if (!held.HasBlock(block)) {
      return Wrong(StrCat("says of a block that is not held that it differs, ", block));
    }
    summary_.differing_blocks.push_back(block);
  }
  return {};
}

Result<TileBlob> SyncExchange::OnTile(const wire::TileMessage& tile, std::uint64_t frame_bytes) {
  if (Status status = Count(frame_bytes); !status.ok()) return Error(std::move(status));
  if (came_ == announced_.size()) return Error(Wrong("sent a tile that it did not announce"));
  const Announced& announced = announced_[came_];
  if (tile.key() != announced.key || tile.revision() != announced.revision ||
      tile.payload_hash() != announced.payload_hash || tile.blob().size() != announced.bytes) {
    return Error(Wrong(StrCat("sent another tile than it announced: key ", tile.key(), ", ",
                              tile.blob().size(), " bytes, expected ", announced.key, ", ",
                              announced.bytes)));
  }
  if (tile.base_hash() != 0 && (!query_.takes_deltas || !IsHeld(tile))) {
    return Error(Wrong(StrCat("sent a delta to what is not held, key ", tile.key())));
  }
  ++came_;
  ++summary_.tiles;
  summary_.deltas += tile.base_hash() != 0 ? 1U : 0U;
  const ByteSpan blob = BytesFromWire(tile.blob());
  return TileBlob{*TileId::FromKey(tile.key()), tile.revision(), tile.payload_hash(),
                  Bytes(blob.begin(), blob.end()), tile.base_hash()};
}

bool SyncExchange::IsHeld(const wire::TileMessage& tile) const {
  return std::any_of(query_.held.begin(), query_.held.end(), [&](const HeldGroup& group) {
    return std::any_of(group.tiles.begin(), group.tiles.end(), [&](const HeldGroup::OneTile& held) {
      return held.id.Key() == tile.key() && held.payload_hash == tile.base_hash();
    });
  });
}

SyncSummary SyncExchange::so_far() const {
  SyncSummary came;
  came.tiles = summary_.tiles;
  came.deltas = summary_.deltas;
  came.bytes = summary_.bytes;
  return came;
}

Result<SyncSummary> SyncExchange::OnEnd(const wire::SyncEnd& end, std::uint64_t frame_bytes) {
  Status status = Count(frame_bytes);
  if (status.ok()) status = CheckAllCame();
  if (status.ok() && !has_begun_) status = Wrong("ended without a manifest");
  if (status.ok() && (end.tiles() != summary_.tiles || end.bytes() != summary_.bytes)) {
    status = Wrong(StrCat("counted ", end.tiles(), " tiles and ", end.bytes(), " bytes, ",
                          summary_.tiles, " and ", summary_.bytes, " came"));
  }
  if (!status.ok()) return Error(std::move(status));
  summary_.revision = end.revision();
  const ByteSpan cursor = BytesFromWire(end.cursor());
  summary_.cursor.assign(cursor.begin(), cursor.end());
  return std::move(summary_);
}

}  // namespace atlas
