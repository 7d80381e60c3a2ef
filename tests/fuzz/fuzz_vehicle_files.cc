// Files in the folder of an atlas on a vehicle's disk: a tile, or (first byte 'a') the one that
// says which atlas it is of. The rest of the input is the file.
#include <fstream>
#include <iterator>

#include "client/vehicle/tile_files.h"
#include "client/vehicle/tile_store.h"
#include "core/base/hash.h"
#include "core/tile/tile_codec.h"
#include "tests/fuzz/support/scratch_folder.h"
#include "tests/fuzz/support/tile_packing.h"

namespace atlas::fuzz {
namespace {

namespace fs = std::filesystem;

AtlasKey Atlas() {
  return {Bytes(16, 7), TileProfile()};
}

Bytes ReadBack(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// A folder as the store leaves it, with one tile.
class Folder {
 public:
  Folder() {
    TileFiles files = TileFiles::Open(scratch_.path(), Atlas()).value();
    const Bytes blob = TileSeeds()[0];
    const Bytes payload = TilePayloadFromBlob(blob).value();
    facts_ = {TileId{0, -7, 12}, 5, Hash64(payload), kEverySection};
    Require(files.Write(facts_, blob).has_value(), "a tile is written");
    for (const auto& entry : fs::directory_iterator(files.folder())) {
      (entry.path().extension() == ".tile" ? tile_ : atlas_) = entry.path();
    }
    whole_atlas_ = ReadBack(atlas_);
  }

  const fs::path& tile() const { return tile_; }
  const fs::path& atlas() const { return atlas_; }

  bool ReadTile(ByteSpan content) {
    Put(atlas_, whole_atlas_);
    Put(tile_, content);
    TileStoreOptions options;
    options.folder = scratch_.path();
    auto store = TileStore::Open(Atlas(), options);
    Require(store.has_value() && store->disk_problem().ok() && store->size() == 1,
            "a folder is opened by its names");
    const auto blob = store->Read(facts_.id);
    if (blob) {
      static_cast<void>(DecodeTile(**blob, TileProfile()));  // what it says may be anything
    }
    Require(blob.has_value() == (store->size() == 1), "what is damaged is not held");
    return blob.has_value();
  }

  bool ReadAtlas(ByteSpan content) {
    Put(atlas_, content);
    const std::vector<AtlasKey> known = KnownAtlases(scratch_.path());
    for (const AtlasKey& key : known) {
      Require(key.Validate().ok() && key.profile.Validate().ok(), "a known atlas is one");
    }
    return !known.empty();
  }

 private:
  void Put(const fs::path& path, ByteSpan content) {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out << TextOf(content);
    out.close();
    Require(out.good(), "a file is written");
  }

  ScratchFolder scratch_;
  TileFacts facts_;
  fs::path tile_;
  fs::path atlas_;
  Bytes whole_atlas_;
};

Folder& OfProcess() {
  static Folder folder;
  return folder;
}

std::vector<Bytes> Seeds() {
  static const std::vector<Bytes> kSeeds = [] {
    Bytes tile = ReadBack(OfProcess().tile());
    Bytes atlas = ReadBack(OfProcess().atlas());
    tile.insert(tile.begin(), 't');
    atlas.insert(atlas.begin(), 'a');
    return std::vector<Bytes>{tile, atlas};
  }();
  return kSeeds;
}

bool Run(ByteSpan input) {
  if (input.empty()) {
    return false;
  }
  return input[0] == 'a' ? OfProcess().ReadAtlas(input.subspan(1))
                         : OfProcess().ReadTile(input.subspan(1));
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  Bytes changed = Garbled(input, max_size);
  if (!OneIn(4, random)) {
    Bytes file(changed.begin() + 1, changed.end());
    SealAtEnd(file);
    std::copy(file.begin(), file.end(), changed.begin() + 1);
  }
  return changed;
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
