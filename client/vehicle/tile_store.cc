#include "client/vehicle/tile_store.h"

#include <algorithm>
#include <utility>

#include "client/vehicle/area_bounds.h"
#include "client/vehicle/area_touch.h"
#include "client/vehicle/held_summary.h"
#include "client/vehicle/stored_file.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_container.h"
#include "core/tile/tile_delta.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxDropped = 65'536;
// Of what the store can hold, for the coarse tiles elsewhere where there is no room.
constexpr std::uint64_t kCoarsePart = 4;

// Every byte of the blob is looked at here, once, so that nothing damaged is ever kept.
Status CheckBlob(ByteSpan blob,
                 const TileBlob& tile,
                 const MapProfile& profile,
                 SectionBits sections) {
  const Result<TileContainer> container = DecodeContainer(blob);
  if (!container) return container.error();
  if (container->key != tile.id.Key() || container->profile_hash != profile.Hash()) {
    return {StatusCode::kInvalidData, "a blob of another tile or profile"};
  }
  const bool is_whole = sections == kEverySection;
  if (is_whole && Hash64(EncodeContainerPayload(*container)) != tile.payload_hash) {
    return {StatusCode::kInvalidData, "the content is not what its hash says"};
  }
  return {};
}

// What was held when it was asked for may be gone since.
SectionBits SectionsThatCame(const TileBlob& tile, const AskedSections& asked) {
  const auto held = asked.but_held.find(tile.id.Key());
  const bool is_rest =
      held != asked.but_held.end() && held->second.payload_hash == tile.payload_hash;
  return is_rest ? asked.sections & ~held->second.sections : asked.sections;
}

// What came, with what it is to be joined with; null: nothing that is held.
Result<Bytes> Joined(const TileBlob& tile, const Bytes* base) {
  if (tile.base_hash == 0) return base == nullptr ? tile.blob : MergeSections(*base, tile.blob);
  if (base == nullptr) return Error(StatusCode::kInvalidData, "a delta to what is not held");
  return ApplyTileDelta(*base, tile.blob);
}

std::unordered_set<std::uint64_t> KeysOf(const std::vector<TileId>& ids) {
  std::unordered_set<std::uint64_t> keys;
  for (const TileId& id : ids) {
    keys.insert(id.Key());
  }
  return keys;
}

// Nothing is left to be read. All else the disk may say and have the file all the same.
bool IsLost(StatusCode code) {
  return code == StatusCode::kInvalidData || code == StatusCode::kNotFound;
}

}  // namespace

TileStore::TileStore(AtlasKey atlas, const TileStoreOptions& options)
    : atlas_(std::move(atlas)),
      options_(options),
      memory_(atlas_.profile.levels),
      disk_(atlas_.profile.levels) {}

Result<TileStore> TileStore::Open(AtlasKey atlas, const TileStoreOptions& options) {
  TileStore store(std::move(atlas), options);
  if (options.folder.empty()) return store;
  if (Status status = store.atlas_.Validate(); !status.ok()) return Error(std::move(status));
  store.disk_problem_ = store.OpenFolder();
  return store;
}

Status TileStore::OpenFolder() {
  ATLAS_RETURN_IF_ERROR(MakeFolder(options_.folder));
  Result<FolderLock> lock = FolderLock::Take(options_.folder);
  // A disk that takes no lock, because it is only read, is used by anybody without harm.
  if (!lock && lock.error().code() == StatusCode::kConflict) return lock.error();
  if (lock) lock_ = *std::move(lock);
  Result<TileFiles> files = TileFiles::Open(options_.folder, atlas_);
  if (!files) return files.error();
  const Result<std::vector<TileFiles::Found>> found_tiles = files->List();
  if (!found_tiles) return found_tiles.error();
  files_ = *std::move(files);
  others_ = OtherAtlases(options_.folder, files_->folder());
  for (const TileFiles::Found& found : *found_tiles) {
    disk_.Insert(found.facts.id, found.bytes);
    tiles_[found.facts.id.Key()] = {found.facts, nullptr, found.bytes, true};
    held_bytes_ += found.bytes;
  }
  TrimDisk(false);
  return {};
}

const TileFacts* TileStore::Find(const TileId& id) const {
  const auto found = tiles_.find(id.Key());
  return found == tiles_.end() ? nullptr : &found->second.facts;
}

bool TileStore::ComesWhole(const TileId& id) const {
  const auto found = tiles_.find(id.Key());
  return found != tiles_.end() && found->second.comes_whole;
}

Result<std::shared_ptr<const Bytes>> TileStore::Read(const TileId& id) {
  const auto found = tiles_.find(id.Key());
  if (found == tiles_.end()) return Error(StatusCode::kNotFound, StrCat("tile ", id, ": not held"));
  Entry& entry = found->second;
  Use(id);
  if (entry.blob != nullptr) return entry.blob;
  Result<Bytes> blob = files_->Read(entry.facts);
  if (!blob) {
    const StatusCode code = blob.error().code();
    if (IsLost(code)) {
      Erase(found);
    } else if (code != StatusCode::kResourceExhausted) {  // that would be the process, not the file
      entry.comes_whole = true;
      ++changes_;
    }
    return Error(blob.error());
  }
  entry.comes_whole = false;
  auto shared = std::make_shared<const Bytes>(*std::move(blob));
  entry.blob = shared;
  memory_.Insert(id, shared->size());
  Trim();
  return shared;
}

// What is held that the tile is to be joined with, whose sections are added to those that came: the
// base of a delta, or more sections of the same content. Null: nothing.
Result<std::shared_ptr<const Bytes>> TileStore::BaseOf(const TileBlob& tile,
                                                       SectionBits& sections) {
  const auto held = tiles_.find(tile.id.Key());
  if (held == tiles_.end()) return nullptr;
  const TileFacts facts = held->second.facts;
  const bool is_delta = tile.base_hash != 0;
  const bool is_rest = sections != kEverySection && !held->second.comes_whole;
  const bool is_base = is_delta ? facts.payload_hash == tile.base_hash
                                : is_rest && facts.payload_hash == tile.payload_hash;
  if (!is_base) return nullptr;
  auto blob = Read(tile.id);
  if (blob) {
    if (!is_delta) sections |= facts.sections;
    return blob;
  }
  if (IsLost(blob.error().code())) return nullptr;
  held->second.comes_whole = true;
  ++changes_;
  return blob;
}

Status TileStore::Put(const TileBlob& tile, const AskedSections& asked) {
  SectionBits sections = SectionsThatCame(tile, asked);
  const Result<std::shared_ptr<const Bytes>> base = BaseOf(tile, sections);
  if (!base) return base.error().WithContext(StrCat("tile ", tile.id));
  Result<Bytes> blob = Joined(tile, base->get());
  Status status = blob ? CheckBlob(*blob, tile, atlas_.profile, sections) : blob.error();
  if (!status.ok()) {
    Remove(tile.id);
    return Status(StatusCode::kInvalidData, status.message()).WithContext(StrCat("tile ", tile.id));
  }
  Keep({tile.id, tile.revision, tile.payload_hash, sections}, *std::move(blob));
  return {};
}

void TileStore::Keep(const TileFacts& facts, Bytes blob) {
  ++changes_;
  const auto old = tiles_.find(facts.id.Key());
  // A file of this name is written over, and stays as it is where that fails.
  const bool has_file = old != tiles_.end() && old->second.is_on_disk && old->second.facts == facts;
  if (old != tiles_.end() && !has_file) Erase(old);
  if (has_file) held_bytes_ -= old->second.bytes;
  Entry entry{facts, nullptr, blob.size(), has_file};
  if (files_) {
    const Result<std::uint64_t> written = files_->Write(facts, blob);
    is_disk_taking_ = written.has_value();
    entry.is_on_disk = has_file || written;
    entry.bytes = written.value_or(has_file ? old->second.bytes : entry.bytes);
    if (written) disk_.Insert(facts.id, *written);
  }
  disk_failures_ += !options_.folder.empty() && !entry.is_on_disk ? 1U : 0U;
  memory_.Insert(facts.id, blob.size());
  entry.blob = std::make_shared<const Bytes>(std::move(blob));
  held_bytes_ += entry.bytes;
  tiles_[facts.id.Key()] = std::move(entry);
  Trim();
}

void TileStore::Trim() {
  TrimMemory();
  TrimDisk(true);
}

void TileStore::TrimMemory() {
  while (const auto id = memory_.TakeAbove(options_.max_memory_bytes)) {
    const auto entry = tiles_.find(id->Key());
    entry->second.blob = nullptr;
    if (!entry->second.is_on_disk) Drop(entry);
  }
}

void TileStore::TrimDisk(bool may_read) {
  if (disk_bytes() > options_.max_disk_bytes) {
    others_.Remove(disk_bytes() - options_.max_disk_bytes);
  }
  while (const auto id = disk_.TakeAbove(options_.max_disk_bytes)) {
    const auto entry = tiles_.find(id->Key());
    const bool stays = entry->second.blob != nullptr || (may_read && TakeIntoMemory(entry->second));
    files_->Remove(entry->second.facts);
    entry->second.is_on_disk = false;
    if (!stays) Drop(entry);
  }
}

bool TileStore::TakeIntoMemory(Entry& entry) {
  if (memory_.bytes() + entry.bytes > options_.max_memory_bytes) return false;
  Result<Bytes> blob = files_->Read(entry.facts);
  if (!blob) return false;
  memory_.Insert(entry.facts.id, blob->size());
  entry.blob = std::make_shared<const Bytes>(*std::move(blob));
  entry.comes_whole = false;
  return true;
}

std::uint64_t TileStore::capacity_bytes() const {
  if (!files_) return options_.max_memory_bytes;
  const std::uint64_t on_disk = is_disk_taking_ ? options_.max_disk_bytes : disk_.bytes();
  return std::max<std::uint64_t>(options_.max_memory_bytes, on_disk);
}

std::uint64_t TileStore::BytesOf(const std::vector<TileId>& ids) const {
  std::uint64_t bytes = 0;
  for (const TileId& id : ids) {
    const auto found = tiles_.find(id.Key());
    bytes += found == tiles_.end() ? 0 : found->second.bytes;
  }
  return bytes;
}

std::uint64_t TileStore::OtherCoarseBytes(const std::unordered_set<std::uint64_t>& keys) const {
  std::uint64_t bytes = 0;
  for (const auto& [key, entry] : tiles_) {
    if (memory_.IsCoarse(entry.facts.id) && !keys.contains(key)) bytes += entry.bytes;
  }
  return bytes;
}

std::uint64_t TileStore::RoomAmong(const std::vector<TileId>& ids) const {
  const std::uint64_t capacity = capacity_bytes();
  return capacity - std::min(capacity, OtherCoarseBytes(KeysOf(ids)));
}

void TileStore::RemoveCoarse(const std::vector<TileId>& but) {
  const auto keys = KeysOf(but);
  const std::uint64_t most = capacity_bytes() / kCoarsePart;
  std::uint64_t bytes = OtherCoarseBytes(keys);
  const auto is_other = [&](const TileId& id) {
    return !keys.contains(id.Key());
  };
  while (bytes > most) {
    auto id = disk_.TakeCoarse(is_other);
    if (!id) id = memory_.TakeCoarse(is_other);
    if (!id) return;
    const auto entry = tiles_.find(id->Key());
    bytes -= entry->second.bytes;
    Erase(entry);
  }
}

void TileStore::Use(const TileId& id) {
  memory_.Use(id);
  disk_.Use(id);
}

// It is in neither order any more.
void TileStore::Drop(Entries::iterator entry) {
  ++changes_;
  if (dropped_.size() < kMaxDropped) dropped_.push_back(entry->second.facts.id);
  held_bytes_ -= entry->second.bytes;
  tiles_.erase(entry);
}

void TileStore::Erase(Entries::iterator entry) {
  ++changes_;
  const TileFacts& facts = entry->second.facts;
  memory_.Remove(facts.id);
  disk_.Remove(facts.id);
  if (entry->second.is_on_disk) files_->Remove(facts);
  held_bytes_ -= entry->second.bytes;
  tiles_.erase(entry);
}

void TileStore::Remove(const TileId& id) {
  const auto found = tiles_.find(id.Key());
  if (found != tiles_.end()) Erase(found);
}

void TileStore::Apply(const SyncSummary& summary) {
  for (const TileId& id : summary.removed) {
    Remove(id);
    std::erase(dropped_, id);  // it would have gone anyway
  }
  const bool is_whole = summary.cursor.empty() && summary.differing_blocks.empty();
  if (is_whole) differing_.clear();
  differing_.insert(summary.differing_blocks.begin(), summary.differing_blocks.end());
}

std::vector<HeldGroup> TileStore::Held(const MapArea& area,
                                       std::uint8_t finest,
                                       std::uint8_t coarsest,
                                       HeldInPart& in_part) const {
  const AreaBounds bounds(area, atlas_.profile);
  HeldSummary summary(differing_);
  in_part.clear();
  const std::uint64_t first = std::uint64_t{finest} << 58U;
  const std::uint64_t last = (std::uint64_t{coarsest} + 1) << 58U;
  for (auto entry = tiles_.lower_bound(first); entry != tiles_.end() && entry->first < last;
       ++entry) {
    const TileFacts& facts = entry->second.facts;
    if (entry->second.comes_whole || !bounds.MayTouchBlock(facts.id)) continue;
    summary.Add(facts);
    if (facts.sections != kEverySection) in_part[entry->first] = facts;
  }
  return summary.Take();
}

std::vector<TileId> TileStore::TilesIn(const MapArea& area, std::uint8_t finest) const {
  const AreaBounds bounds(area, atlas_.profile);
  std::vector<TileId> ids;
  for (auto entry = tiles_.lower_bound(std::uint64_t{finest} << 58U); entry != tiles_.end();
       ++entry) {
    const TileId& id = entry->second.facts.id;
    if (bounds.MayTouchBlock(id) && Touches(area, id, atlas_.profile)) ids.push_back(id);
  }
  return ids;
}

std::vector<TileId> TileStore::Tiles() const {
  std::vector<TileId> ids;
  for (const auto& [key, entry] : tiles_) {
    ids.push_back(entry.facts.id);
  }
  return ids;
}

}  // namespace atlas
