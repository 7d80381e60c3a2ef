#include "core/tile/tile_delta.h"

#include <utility>
#include <vector>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/tile/raw_container.h"
#include "core/tile/tile_container.h"

namespace atlas {
namespace {

Status Foreign() {
  return {StatusCode::kInvalidArgument, "tile: a difference to a blob of another tile or profile"};
}

// Empty where the base has none.
ByteSpan Prefix(const TileContainer& base, std::uint16_t id) {
  const TileContainer::Section* section = base.Find(id);
  return section == nullptr ? ByteSpan() : ByteSpan(section->content);
}

Result<Bytes> ApplySection(const TileContainer& base, const RawSection& section) {
  Result<Bytes> content =
      DecompressAgainst(Prefix(base, section.id), section.compressed, section.uncompressed_bytes);
  if (!content) {
    return Error(content.error().WithContext(StrCat("tile: section ", section.id)));
  }
  if (Hash64(*content) != section.hash) {
    return Error(StatusCode::kInvalidData,
                 StrCat("tile: section ", section.id, " is of a difference to another base"));
  }
  return content;
}

}  // namespace

Result<Bytes> EncodeTileDelta(ByteSpan base_blob, ByteSpan target_blob) {
  const Result<TileContainer> base = DecodeContainer(base_blob);
  if (!base) {
    return Error(base.error());
  }
  const Result<TileContainer> target = DecodeContainer(target_blob);
  if (!target) {
    return Error(target.error());
  }
  if (base->key != target->key || base->profile_hash != target->profile_hash) {
    return Error(Foreign());
  }
  RawContainer delta{target->key, target->profile_hash, target->preset, {}};
  std::vector<Bytes> compressed;
  compressed.reserve(target->sections.size());
  for (const TileContainer::Section& section : target->sections) {
    const Bytes& bytes = compressed.emplace_back(
        CompressAgainst(Prefix(*base, section.id), section.content, kTileCompressionLevel));
    delta.sections.push_back({section.id, static_cast<std::uint32_t>(section.content.size()),
                              Hash64(section.content), bytes});
  }
  return WriteRaw(delta, kTileDeltaMagic);
}

Result<Bytes> ApplyTileDelta(ByteSpan base_blob, ByteSpan delta_blob) {
  const Result<RawContainer> delta = ReadRaw(delta_blob, kTileDeltaMagic);
  if (!delta) {
    return Error(delta.error());
  }
  const Result<TileContainer> base = DecodeContainer(base_blob);
  if (!base) {
    return Error(base.error());
  }
  if (base->key != delta->key || base->profile_hash != delta->profile_hash) {
    return Error(Foreign());
  }
  TileContainer target{delta->key, delta->profile_hash, delta->preset, {}};
  for (const RawSection& section : delta->sections) {
    Result<Bytes> content = ApplySection(*base, section);
    if (!content) {
      return Error(content.error());
    }
    target.sections.push_back({section.id, *std::move(content)});
  }
  return EncodeContainer(target);
}

}  // namespace atlas
