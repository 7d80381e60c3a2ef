// Differences between two contents of a tile, applied to the content that the receiver holds.
#include <algorithm>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/tile/raw_container.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_container.h"
#include "core/tile/tile_delta.h"
#include "tests/core/support/tile_worlds.h"
#include "tests/fuzz/support/tile_packing.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kMaxPackedSections = 80;

const TileContainer& Base() {
  static const TileContainer kBase = DecodeContainer(TileSeeds()[0]).value();
  return kBase;
}

ByteSpan PrefixOf(std::uint16_t id) {
  const TileContainer::Section* section = Base().Find(id);
  return section == nullptr ? ByteSpan() : ByteSpan(section->content);
}

std::vector<Bytes> Seeds() {
  const Bytes base = TileSeeds()[0];
  Tile changed = DecodeTile(base, TileProfile()).value();
  changed.layers[3].altitude_mm -= 10;
  changed.layers[7].observations += 1;
  changed.contributors.push_back({"truck", "night"});
  const Bytes target = EncodeTile(changed, TileProfile()).blob;
  const Bytes surface = SelectSections(base, SectionMask{0b110}).value();
  return {EncodeTileDelta(base, target).value(), EncodeTileDelta(base, surface).value()};
}

std::optional<Bytes> Unpack(ByteSpan blob) {
  const auto delta = ReadRaw(blob, kTileDeltaMagic);
  if (!delta) {
    return std::nullopt;
  }
  ByteWriter flat;
  flat.U64(delta->key);
  flat.U64(delta->profile_hash);
  flat.U8(delta->preset);
  for (const RawSection& section : delta->sections) {
    const auto content =
        DecompressAgainst(PrefixOf(section.id), section.compressed, section.uncompressed_bytes);
    if (!content) {
      return std::nullopt;
    }
    flat.U16(section.id);
    flat.U32(section.uncompressed_bytes);
    flat.Raw(*content);
  }
  return flat.Take();
}

Bytes Pack(ByteSpan flat) {
  ByteReader in(flat);
  RawContainer delta{in.U64(), in.U64(), in.U8(), {}};
  std::vector<Bytes> compressed;
  compressed.reserve(kMaxPackedSections);  // the sections refer to it
  while (in.ok() && in.remaining() > 0 && compressed.size() < kMaxPackedSections) {
    const std::uint16_t id = in.U16();
    const ByteSpan content = in.Raw(std::min<std::size_t>(in.U32(), in.remaining()));
    compressed.push_back(CompressAgainst(PrefixOf(id), content, 1));
    delta.sections.push_back(
        {id, static_cast<std::uint32_t>(content.size()), Hash64(content), compressed.back()});
  }
  return WriteRaw(delta, kTileDeltaMagic);
}

bool Run(ByteSpan delta) {
  static const Bytes kBase = TileSeeds()[0];
  const auto target = ApplyTileDelta(kBase, delta);
  if (!target) {
    return false;
  }
  const auto container = DecodeContainer(*target);
  Require(container.has_value() && container->key == Base().key,
          "a delta makes a blob of its tile");
  static_cast<void>(DecodeTile(*target, TileProfile()));  // what it says may be anything
  return true;
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return MutatePacked(input, max_size, random, {&Unpack, &Pack, &SealTileHeader});
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
