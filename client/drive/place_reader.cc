#include "client/drive/place_reader.h"

#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {

Result<std::shared_ptr<const PlaceIndex>> ReadPlaces(MapSource& source) {
  auto places = std::make_shared<PlaceIndex>(source.profile());
  const Status status = source.ReadLevel(0, std::nullopt, [&](const TileBlob& read) -> Status {
    const Result<Tile> tile = DecodeTile(read.blob, source.profile());
    if (!tile) return tile.error().WithContext(StrCat("tile ", read.id));
    places->Add(*tile);
    return {};
  });
  if (!status.ok()) return Error(status);
  places->Finish();
  return std::shared_ptr<const PlaceIndex>(std::move(places));
}

}  // namespace atlas
