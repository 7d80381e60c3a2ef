// The envelope of a tile blob: magic, key, profile and a table of numbered sections, each
// compressed and checked by itself (docs/formats/tile.md). What the sections mean is none of its
// business.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

struct TileContainer {
  std::uint64_t key = 0;           // TileId::Key()
  std::uint64_t profile_hash = 0;  // MapProfile::Hash()
  std::uint8_t preset = 0;         // FusionPreset, the profile's: for whoever has only the blob
  struct Section {
    std::uint16_t id = 0;
    Bytes content;  // uncompressed
  };
  std::vector<Section> sections;  // ids rising

  const Section* Find(std::uint16_t id) const;
};

// The canonical payload: key, profile hash, then for each section id, length and content.
Bytes EncodeContainerPayload(const TileContainer& container);

// The blob, each section compressed.
Bytes EncodeContainer(const TileContainer& container);

// Sections by their ids: the bit 1 << id; those from 64 on go with all of them.
using SectionMask = std::uint64_t;
inline constexpr SectionMask kAllSections = ~SectionMask{0};

// The blob of the same tile with these of its sections only, as they were compressed. Verifies the
// header, not the sections. Errors as DecodeContainer.
Result<Bytes> SelectSections(ByteSpan blob, SectionMask sections);
// The blob with the sections of both, those of `added` where both have one. kInvalidArgument: they
// are of different tiles. kInvalidData: together they are more than a blob holds.
Result<Bytes> MergeSections(ByteSpan blob, ByteSpan added);

// Verifies every checksum and size. kUnsupported on another version, kInvalidData otherwise.
Result<TileContainer> DecodeContainer(ByteSpan blob);

}  // namespace atlas
