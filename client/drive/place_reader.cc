#include "client/drive/place_reader.h"

#include <utility>

namespace atlas {

Result<std::shared_ptr<const PlaceIndex>> ReadPlaces(MapView& view) {
  auto places = std::make_shared<PlaceIndex>(view.profile());
  const Status status = view.ReadAll(0, [&](const Tile& tile) { places->Add(tile); });
  if (!status.ok()) return Error(status);
  places->Finish();
  return std::shared_ptr<const PlaceIndex>(std::move(places));
}

}  // namespace atlas
