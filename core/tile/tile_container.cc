#include "core/tile/tile_container.h"

#include <algorithm>
#include <utility>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/tile/raw_container.h"

namespace atlas {
namespace {

Result<Bytes> Unpack(const RawSection& section) {
  if (Hash64(section.compressed) != section.hash) {
    return Error(StatusCode::kInvalidData,
                 StrCat("tile: section ", section.id, " is truncated or damaged"));
  }
  Result<Bytes> content = Decompress(section.compressed, section.uncompressed_bytes);
  if (!content) {
    return Error(content.error().WithContext(StrCat("tile: section ", section.id)));
  }
  return content;
}

}  // namespace

const TileContainer::Section* TileContainer::Find(std::uint16_t id) const {
  const auto found =
      std::find_if(sections.begin(), sections.end(), [id](const Section& s) { return s.id == id; });
  return found == sections.end() ? nullptr : &*found;
}

Bytes EncodeContainerPayload(const TileContainer& container) {
  ByteWriter out;
  out.U64(container.key);
  out.U64(container.profile_hash);
  for (const TileContainer::Section& section : container.sections) {
    out.U16(section.id);
    out.U32(static_cast<std::uint32_t>(section.content.size()));
    out.Raw(section.content);
  }
  return out.Take();
}

Bytes EncodeContainer(const TileContainer& container) {
  RawContainer raw{container.key, container.profile_hash, container.preset, {}};
  std::vector<Bytes> compressed;
  compressed.reserve(container.sections.size());
  for (const TileContainer::Section& section : container.sections) {
    const Bytes& bytes = compressed.emplace_back(Compress(section.content, kTileCompressionLevel));
    raw.sections.push_back(
        {section.id, static_cast<std::uint32_t>(section.content.size()), Hash64(bytes), bytes});
  }
  return WriteRaw(raw, kTileMagic);
}

Result<TileContainer> DecodeContainer(ByteSpan blob) {
  const Result<RawContainer> raw = ReadRaw(blob, kTileMagic);
  if (!raw) {
    return Error(raw.error());
  }
  TileContainer container{raw->key, raw->profile_hash, raw->preset, {}};
  for (const RawSection& section : raw->sections) {
    Result<Bytes> content = Unpack(section);
    if (!content) {
      return Error(content.error());
    }
    container.sections.push_back({section.id, *std::move(content)});
  }
  return container;
}

Result<Bytes> SelectSections(ByteSpan blob, SectionMask sections) {
  Result<RawContainer> raw = ReadRaw(blob, kTileMagic);
  if (!raw) {
    return Error(raw.error());
  }
  std::erase_if(raw->sections, [sections](const RawSection& section) {
    return section.id < 64 ? (sections >> section.id & 1u) == 0 : sections != kAllSections;
  });
  return WriteRaw(*raw, kTileMagic);
}

Result<Bytes> MergeSections(ByteSpan blob, ByteSpan added) {
  Result<RawContainer> merged = ReadRaw(added, kTileMagic);
  if (!merged) {
    return Error(merged.error());
  }
  const Result<RawContainer> second = ReadRaw(blob, kTileMagic);
  if (!second) {
    return Error(second.error());
  }
  if (merged->key != second->key || merged->profile_hash != second->profile_hash) {
    return Error(StatusCode::kInvalidArgument,
                 "tile: sections of different tiles do not go together");
  }
  // The first of equals stays.
  std::vector<RawSection>& sections = merged->sections;
  sections.insert(sections.end(), second->sections.begin(), second->sections.end());
  std::stable_sort(sections.begin(), sections.end(),
                   [](const RawSection& a, const RawSection& b) { return a.id < b.id; });
  const auto end =
      std::unique(sections.begin(), sections.end(),
                  [](const RawSection& a, const RawSection& b) { return a.id == b.id; });
  sections.erase(end, sections.end());
  Bytes both = WriteRaw(*merged, kTileMagic);
  if (const auto read = ReadRaw(both, kTileMagic); !read) {  // more than a blob holds
    return Error(read.error());
  }
  return both;
}

}  // namespace atlas
