// The tiles that a vehicle holds, as syncs brought them: encoded, merged section by section,
// bounded in memory and, where there is a folder, on disk, where they outlive the program. Nothing
// of it depends on a daemon. One thread at a time, one process a folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <unordered_set>
#include <utility>
#include <vector>

#include "client/connection/requests.h"
#include "client/vehicle/eviction_order.h"
#include "client/vehicle/folder_lock.h"
#include "client/vehicle/other_atlases.h"
#include "client/vehicle/tile_files.h"
#include "core/base/status.h"

namespace atlas {

struct TileStoreOptions {
  std::size_t max_memory_bytes = std::size_t{256} << 20;
  std::filesystem::path folder = {};  // empty: nothing outlives the store
  // Of all atlases in the folder: the others' tiles go first.
  std::uint64_t max_disk_bytes = std::uint64_t{4} << 30;
};

// By key: tiles that are held with some of their sections.
using HeldInPart = std::map<std::uint64_t, TileFacts>;

// With which sections the tiles of a sync come.
struct AskedSections {
  SectionBits sections = kEverySection;
  HeldInPart but_held = {};  // of the same content: these sections are left out
};

class TileStore {
 public:
  // Reads the folder's names, no tile; files beyond the limit go. A folder that the disk does not
  // let it make or use, or that another store has (kConflict), leaves a store in memory, and
  // disk_problem says why. kInvalidArgument: an atlas id that is none.
  static Result<TileStore> Open(AtlasKey atlas, const TileStoreOptions& options);

  TileStore(const TileStore&) = delete;  // its orders point into themselves
  TileStore& operator=(const TileStore&) = delete;
  TileStore(TileStore&&) = default;
  TileStore& operator=(TileStore&&) = default;
  ~TileStore() = default;

  const AtlasKey& atlas() const { return atlas_; }
  std::size_t size() const { return tiles_.size(); }
  // Moves whenever a tile comes, changes, goes or is to come again.
  std::uint64_t changes() const { return changes_; }
  // Of the tiles that are held, wherever: of each its file's, or its blob's where it had none.
  std::uint64_t held_bytes() const { return held_bytes_; }
  // Of as much there is room for: in memory, or on disk where that is more.
  std::uint64_t capacity_bytes() const;
  // The same of these tiles, whether all of them are held or not.
  std::uint64_t BytesOf(const std::vector<TileId>& ids) const;
  // What there is room for where these tiles, and others that come, are of use: the coarse ones
  // elsewhere go last, and stay.
  std::uint64_t RoomAmong(const std::vector<TileId>& ids) const;
  std::size_t memory_bytes() const { return memory_.bytes(); }
  std::uint64_t disk_bytes() const { return disk_.bytes() + others_.bytes(); }
  // Tiles that the disk had no room for, or would not take: held in memory only.
  std::uint64_t disk_failures() const { return disk_failures_; }
  // Ok, or why nothing outlives the store although it was given a folder.
  const Status& disk_problem() const { return disk_problem_; }

  // Null: not held.
  const TileFacts* Find(const TileId& id) const;
  // The blob, never null. kNotFound: not held. kInvalidData, or kNotFound: its file was damaged, or
  // is gone, and it is not held any more. Any other: what the disk said; the tile is held still and
  // may be read later.
  Result<std::shared_ptr<const Bytes>> Read(const TileId& id);
  // It is of use, as when it is read: others go first when there is no room.
  void Use(const TileId& id);
  // A tile that came with the sections `asked` of it, or as a delta to what is held. Sections that
  // are held of the same content are kept. kInvalidData, and that tile not held, when the blob is
  // not what the hash says, or the delta's base is not held any more. Errors of Read where what it
  // is to be joined with cannot be read now: that stays held, and the tile is to come as a whole.
  Status Put(const TileBlob& tile, const AskedSections& asked = {});
  // Held, but of no use until all of it came once more: a delta came that could not be applied to
  // it, or the disk failed at its file. Not told to a daemon; a Read that succeeds ends it.
  bool ComesWhole(const TileId& id) const;
  void Remove(const TileId& id);
  // Where there is no room: the coarse tiles but these go, until they are a quarter of what it can
  // hold.
  void RemoveCoarse(const std::vector<TileId>& but);
  // Tiles for which there was no room any more since the last call, 65,536 of them at most.
  std::vector<TileId> TakeDropped() { return std::exchange(dropped_, {}); }
  // What a sync said of held tiles: some are no more, some blocks must be told tile by tile.
  void Apply(const SyncSummary& summary);

  // What to tell a daemon in a sync of this area: blocks where there are many tiles, single ones
  // where there are few. `in_part`: those of them that come without what is held, if they do.
  std::vector<HeldGroup> Held(const MapArea& area,
                              std::uint8_t finest,
                              std::uint8_t coarsest,
                              HeldInPart& in_part) const;
  // Of these levels, in key order: finest first.
  std::vector<TileId> TilesIn(const MapArea& area, std::uint8_t finest) const;
  std::vector<TileId> Tiles() const;

 private:
  struct Entry {
    TileFacts facts;
    std::shared_ptr<const Bytes> blob;  // null: only on disk
    std::uint64_t bytes = 0;            // of its file, or of its blob where it had none
    bool is_on_disk = false;
    bool comes_whole = false;
  };
  using Entries = std::map<std::uint64_t, Entry>;  // by key

  TileStore(AtlasKey atlas, const TileStoreOptions& options);
  Status OpenFolder();
  Result<std::shared_ptr<const Bytes>> BaseOf(const TileBlob& tile, SectionBits& sections);
  void Keep(const TileFacts& facts, Bytes blob);
  void Trim();
  void TrimMemory();
  // A tile that is only there stays in memory where that has room, if it may be read.
  void TrimDisk(bool may_read);
  // False: there is no room, or it cannot be read.
  bool TakeIntoMemory(Entry& entry);
  std::uint64_t OtherCoarseBytes(const std::unordered_set<std::uint64_t>& keys) const;
  void Drop(Entries::iterator entry);
  void Erase(Entries::iterator entry);

  AtlasKey atlas_;
  TileStoreOptions options_;
  std::optional<FolderLock> lock_;  // of the folder, with all atlases in it
  std::optional<TileFiles> files_;
  OtherAtlases others_;
  Entries tiles_;
  EvictionOrder memory_;
  EvictionOrder disk_;
  std::set<std::uint64_t> differing_;  // blocks to be told tile by tile
  std::vector<TileId> dropped_;
  std::uint64_t held_bytes_ = 0;
  bool is_disk_taking_ = true;  // it took the last tile
  std::uint64_t changes_ = 0;
  std::uint64_t disk_failures_ = 0;
  Status disk_problem_;
};

}  // namespace atlas
