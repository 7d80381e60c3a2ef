#include "tests/fuzz/support/tile_packing.h"

#include <algorithm>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/tile/raw_container.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_container.h"
#include "tests/core/support/golden_profile.h"
#include "tests/core/support/tile_worlds.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kBeforeTable = 4 + 1 + 8 + 8 + 1;  // docs/formats/tile.md
constexpr std::size_t kEntryBytes = 2 + 4 + 4 + 8;
constexpr std::size_t kMaxPackedSections = 80;  // more than a blob may have

std::optional<Bytes> Unpack(ByteSpan blob) {
  const auto container = DecodeContainer(blob);
  if (!container) {
    return std::nullopt;
  }
  ByteWriter flat;
  flat.U64(container->key);
  flat.U64(container->profile_hash);
  flat.U8(container->preset);
  for (const TileContainer::Section& section : container->sections) {
    flat.U16(section.id);
    flat.U32(static_cast<std::uint32_t>(section.content.size()));
    flat.Raw(section.content);
  }
  return flat.Take();
}

Bytes Pack(ByteSpan flat) {
  ByteReader in(flat);
  TileContainer container;
  container.key = in.U64();
  container.profile_hash = in.U64();
  container.preset = in.U8();
  while (in.ok() && in.remaining() > 0 && container.sections.size() < kMaxPackedSections) {
    const std::uint16_t id = in.U16();
    const std::size_t size = std::min<std::size_t>(in.U32(), in.remaining());
    const ByteSpan content = in.Raw(size);
    container.sections.push_back({id, Bytes(content.begin(), content.end())});
  }
  return EncodeContainer(container);
}

}  // namespace

void SealTileHeader(Bytes& blob) {
  if (blob.size() < kBeforeTable + 2) {
    return;
  }
  ByteReader count(ByteSpan(blob).subspan(kBeforeTable));
  const std::size_t header = kBeforeTable + 2 + count.U16() * kEntryBytes;
  if (blob.size() < header + sizeof(std::uint64_t)) {
    return;
  }
  ByteWriter hash;
  hash.U64(Hash64(ByteSpan(blob).first(header)));
  std::copy(hash.bytes().begin(), hash.bytes().end(),
            blob.begin() + static_cast<std::ptrdiff_t>(header));
}

Bytes MutateTile(ByteSpan blob, std::size_t max_size, Random& random) {
  return MutatePacked(blob, max_size, random, {&Unpack, &Pack, &SealTileHeader});
}

MapProfile TileProfile() {
  return testing::GoldenProfile();
}

namespace {

// A floor that can be driven on, with a pillar in its middle.
Bytes FlatTile() {
  const MapProfile profile = TileProfile();
  Tile tile = EmptyTile({0, 1, -1}, profile);
  tile.contributors = {{"car", "drive"}};
  const std::size_t cells = tile.cell_begin.size() - 1;
  const TileLayer floor{
      .altitude_mm = 1'500, .sigma_100um = 4, .occupancy = -64, .flags = 7, .observations = 9};
  tile.layers.assign(cells, floor);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(cell + 1);
  }
  tile.layers[cells / 2] = {
      .altitude_mm = 1'500, .sigma_100um = 4, .occupancy = 64, .observations = 9, .column = 0xFFF};
  return EncodeTile(tile, profile).blob;
}

}  // namespace

std::vector<Bytes> TileSeeds() {
  const MapProfile profile = TileProfile();
  const Tile full = testing::RandomTile({0, -7, 12}, profile, 5);
  Tile one = EmptyTile({2, 0, 0}, profile);
  one.contributors = {{"car", "drive"}};
  one.layers = {TileLayer{.altitude_mm = -1'200, .sigma_100um = 4, .flags = 7, .observations = 3}};
  std::fill(one.cell_begin.begin() + 100, one.cell_begin.end(), 1u);
  const Bytes blob = EncodeTile(full, profile).blob;
  return {blob, EncodeTile(one, profile).blob, SelectSections(blob, SectionMask{0b110}).value(),
          FlatTile()};
}

}  // namespace atlas::fuzz
