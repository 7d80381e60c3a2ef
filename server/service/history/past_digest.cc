#include "server/service/history/past_digest.h"

#include <utility>
#include <vector>

#include "core/tile/tile_codec.h"
#include "server/service/history/scratch_file.h"
#include "server/store/tile_hasher.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 256;

// Takes tiles depth first and hashes them level by level.
class LevelSorter {
 public:
  LevelSorter(const MapProfile& profile, std::filesystem::path scratch)
      : profile_(profile), scratch_(std::move(scratch)) {}

  Status Add(const Tile& tile) {
    if (tile.id.level == 0) {
      hasher_.Add(tile.id, EncodeTilePayload(tile, profile_));
      return {};
    }
    while (waiting_.size() < tile.id.level) {
      auto file = ScratchFile::Create(scratch_);
      if (!file) {
        return file.error();
      }
      waiting_.push_back(std::move(*file));
    }
    return waiting_[tile.id.level - 1u].Append(tile.id.Key(), EncodeTile(tile, profile_).blob);
  }

  Result<AtlasDigest> Finish(std::uint64_t revision) {
    for (ScratchFile& level : waiting_) {
      const Status status = level.Replay([this](std::uint64_t key, ByteSpan blob) {
        const auto id = TileId::FromKey(key);
        const auto payload = TilePayloadFromBlob(blob);
        if (!id || !payload) {
          return id ? payload.error() : id.error();
        }
        hasher_.Add(*id, *payload);
        return Status();
      });
      if (!status.ok()) {
        return Error(status);
      }
    }
    const auto sha256 = hasher_.Finish();
    if (!sha256) {
      return Error(sha256.error());
    }
    return AtlasDigest{*sha256, hasher_.tiles(), revision};
  }

 private:
  const MapProfile& profile_;
  std::filesystem::path scratch_;
  TileHasher hasher_;
  std::vector<ScratchFile> waiting_;  // levels 1 and up
};

}  // namespace

Result<AtlasDigest> ComputePastDigest(AtlasStore& store,
                                      const PastOptions& options,
                                      const std::filesystem::path& scratch) {
  const MapProfile& profile = store.identity().profile;
  const auto top = static_cast<std::uint8_t>(profile.levels - 1);
  PastTiles tiles(store, options);
  LevelSorter sorter(profile, scratch);
  const auto on_tile = [&sorter](const Tile& tile) {
    return sorter.Add(tile);
  };
  std::int64_t after = -1;
  while (true) {
    const auto page = store.ListFootprintTiles(top, after, kPage);
    if (!page) {
      return Error(page.error());
    }
    if (page->empty()) {
      return sorter.Finish(options.revision);
    }
    for (const TileId& id : *page) {
      if (const auto tile = tiles.Build(id, on_tile); !tile) {
        return Error(tile.error());
      }
    }
    after = static_cast<std::int64_t>(page->back().Key());
  }
}

}  // namespace atlas
