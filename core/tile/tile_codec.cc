#include "core/tile/tile_codec.h"

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_container.h"
#include "core/tile/tile_sections.h"

namespace atlas {
namespace {

constexpr std::uint16_t SectionId(TileSection section) {
  return static_cast<std::uint16_t>(section);
}

TileContainer MakeContainer(const Tile& tile, const MapProfile& profile) {
  TileContainer container;
  container.key = tile.id.Key();
  container.profile_hash = profile.Hash();
  container.preset = static_cast<std::uint8_t>(profile.preset);
  container.sections = {
      {SectionId(TileSection::kContributors), EncodeContributors(tile)},
      {SectionId(TileSection::kSurface), EncodeSurface(tile, profile)},
      {SectionId(TileSection::kColumns), EncodeColumns(tile, profile)},
      {SectionId(TileSection::kConfirmed), EncodeConfirmed(tile, profile)},
  };
  return container;
}

Status DecodeSections(const TileContainer& container, const MapProfile& profile, Tile& tile) {
  const auto* contributors = container.Find(SectionId(TileSection::kContributors));
  const auto* surface = container.Find(SectionId(TileSection::kSurface));
  if (contributors == nullptr || surface == nullptr) {
    return Status(StatusCode::kInvalidData, "tile: has no contributors or no surface section");
  }
  ATLAS_RETURN_IF_ERROR(DecodeContributors(contributors->content, tile));
  ATLAS_RETURN_IF_ERROR(DecodeSurface(surface->content, profile, tile));
  if (const auto* columns = container.Find(SectionId(TileSection::kColumns))) {
    ATLAS_RETURN_IF_ERROR(DecodeColumns(columns->content, profile, tile));
  }
  const auto* confirmed = container.Find(SectionId(TileSection::kConfirmed));
  return confirmed == nullptr ? Status() : DecodeConfirmed(confirmed->content, profile, tile);
}

}  // namespace

Bytes EncodeTilePayload(const Tile& tile, const MapProfile& profile) {
  return EncodeContainerPayload(MakeContainer(tile, profile));
}

EncodedTile EncodeTile(const Tile& tile, const MapProfile& profile) {
  const TileContainer container = MakeContainer(tile, profile);
  return {EncodeContainer(container), Hash64(EncodeContainerPayload(container))};
}

Result<Tile> DecodeTile(ByteSpan blob, const MapProfile& profile) {
  const Result<TileContainer> container = DecodeContainer(blob);
  if (!container) {
    return Error(container.error());
  }
  const Result<TileId> id = TileId::FromKey(container->key);
  if (!id) {
    return Error(id.error());
  }
  if (container->profile_hash != profile.Hash() ||
      container->preset != static_cast<std::uint8_t>(profile.preset)) {
    return Error(StatusCode::kInvalidData, StrCat("tile ", *id, ": made for another map profile"));
  }
  Tile tile;
  tile.id = *id;
  if (Status status = DecodeSections(*container, profile, tile); !status.ok()) {
    return Error(status.WithContext(StrCat("tile ", *id)));
  }
  return tile;
}

Result<Bytes> TilePayloadFromBlob(ByteSpan blob) {
  const Result<TileContainer> container = DecodeContainer(blob);
  if (!container) {
    return Error(container.error());
  }
  return EncodeContainerPayload(*container);
}

}  // namespace atlas
