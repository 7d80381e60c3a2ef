// Tile blobs: what decodes has one encoding, its parts go together again, and everything that is
// made of it decodes as well.
#include "core/tile/tile_codec.h"
#include "core/tile/tile_container.h"
#include "tests/fuzz/support/tile_packing.h"

namespace atlas::fuzz {
namespace {

// Sections of its own and of another tile, whatever their numbers.
void TakeApart(ByteSpan blob) {
  static const std::vector<Bytes> kOthers = TileSeeds();
  const auto surface = SelectSections(blob, SectionMask{0b110});
  const auto rest = SelectSections(blob, ~SectionMask{0b110});
  Require(surface.has_value() == rest.has_value(), "both parts of a blob or none");
  if (!surface) {
    return;
  }
  Require(MergeSections(*surface, *rest).has_value(), "the parts of a blob go together");
  for (const Bytes& other : kOthers) {
    const auto merged = MergeSections(blob, other);
    Require(!merged || SelectSections(*merged, kAllSections).has_value(),
            "what is put together is a blob");
  }
}

bool HasOnlyKnown(const TileContainer& container) {
  return container.sections.size() == 4 && container.sections.front().id == 1 &&
         container.sections.back().id == 4;
}

bool Run(ByteSpan blob) {
  TakeApart(blob);
  const auto container = DecodeContainer(blob);
  const auto payload = TilePayloadFromBlob(blob);
  Require(container.has_value() == payload.has_value(), "a container has a payload");
  const auto tile = DecodeTile(blob, TileProfile());
  if (!tile) {
    return false;
  }
  Require(container.has_value(), "a tile is a container");
  Require(!HasOnlyKnown(*container) || EncodeTilePayload(*tile, TileProfile()) == *payload,
          "a tile has one payload");
  const auto again = DecodeTile(EncodeTile(*tile, TileProfile()).blob, TileProfile());
  Require(again.has_value() && *again == *tile, "a tile reads back");
  return true;
}

}  // namespace

const Target kTarget{&TileSeeds, &Run, &MutateTile};

}  // namespace atlas::fuzz
