#include "server/net/requests/sync_conversion.h"

#include <bit>
#include <cmath>
#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

Status Refuse(const std::string& why) {
  return {StatusCode::kInvalidArgument, StrCat("sync: ", why)};
}

Eigen::Vector2d PointFromWire(const wire::Area::Point& point) {
  return 1e-6 *
         Eigen::Vector2d(static_cast<double>(point.x_um()), static_cast<double>(point.y_um()));
}

double LengthFromWire(std::uint64_t length_um) {
  return 1e-6 * static_cast<double>(length_um);
}

// Of all but tiles.
Result<MapArea> ShapeFromWire(const wire::Area& area) {
  switch (area.shape_case()) {
    case wire::Area::kDisc:
      return DiscArea{PointFromWire(area.disc().center()), LengthFromWire(area.disc().radius_um())};
    case wire::Area::kBox:
      return BoxArea{PointFromWire(area.box().min()), PointFromWire(area.box().max())};
    case wire::Area::kCorridor: {
      CorridorArea corridor{{}, LengthFromWire(area.corridor().half_width_um())};
      for (const wire::Area::Point& point : area.corridor().route()) {
        corridor.route_m.push_back(PointFromWire(point));
      }
      return corridor;
    }
    case wire::Area::kTiles:
    case wire::Area::SHAPE_NOT_SET:
      break;
  }
  return Error(Refuse("an area is a disc, a box, a corridor or tiles"));
}

template <typename Numbers>
Result<SectionMask> SectionsFromWire(const Numbers& numbers) {
  SectionMask sections = 0;
  for (const std::uint32_t number : numbers) {
    if (number > 63) {
      return Error(Refuse(StrCat("section ", number, ", expected at most 63")));
    }
    sections |= SectionMask{1} << number;
  }
  return sections == 0 ? kAllSections : sections;
}

std::size_t CountOf(const wire::SyncRequest& message, int (wire::Held::*size)() const) {
  std::size_t count = 0;
  for (const wire::Held& held : message.held()) {
    count += static_cast<std::size_t>((held.*size)());
  }
  return count;
}

Result<HeldTiles> HeldFromWire(const wire::SyncRequest& message) {
  std::vector<HeldTile> tiles;
  std::vector<HeldBlock> blocks;
  tiles.reserve(CountOf(message, &wire::Held::keys_size));
  blocks.reserve(CountOf(message, &wire::Held::blocks_size));
  for (const wire::Held& held : message.held()) {
    const Result<SectionMask> sections = SectionsFromWire(held.sections());
    if (!sections) {
      return Error(sections.error());
    }
    if (held.keys_size() != held.payload_hashes_size() || held.blocks_size() != held.masks_size() ||
        held.blocks_size() != held.digests_size()) {
      return Error(
          Refuse("expected a hash for each held tile, a mask and a digest for each block"));
    }
    for (int i = 0; i < held.keys_size(); ++i) {
      tiles.push_back({held.keys(i), held.payload_hashes(i), *sections});
    }
    for (int i = 0; i < held.blocks_size(); ++i) {
      blocks.push_back({held.blocks(i), held.masks(i), held.digests(i), *sections});
    }
  }
  return HeldTiles::Create(std::move(tiles), std::move(blocks));
}

// Another number when places are counted differently: a cursor of the daemon before is no place
// then.
constexpr std::uint64_t kOrderVersion = 4;

// Of all that decides on the order. After a restore no cursor from before is a place: tiles behind
// it are what they were earlier.
std::uint64_t HashOfOrder(const SyncRequest& request, const StoreIdentity& atlas) {
  ByteWriter order;
  order.U64(atlas.epoch);
  order.U32(request.finest_level);
  order.U32(request.coarsest_level);
  order.U64(request.area.Hash());
  return Hash64(order.bytes()) + kOrderVersion;
}

// The one of the message that `request` was made of.
Result<SyncCursor> CursorFromWire(const std::string& message,
                                  const SyncRequest& request,
                                  const StoreIdentity& atlas) {
  ByteReader in(BytesFromWire(message));
  SyncCursor cursor;
  cursor.revision = in.U64();
  cursor.priority = std::bit_cast<double>(in.U64());
  cursor.key = in.U64();
  const std::uint64_t order = in.U64();
  if (!in.ok() || in.remaining() > 0 || std::isnan(cursor.priority) ||
      order != HashOfOrder(request, atlas)) {
    return Error(
        Refuse("the cursor is not of a reply of this atlas to this request: ask without one"));
  }
  return cursor;
}

}  // namespace

Result<SyncArea> AreaFromWire(const wire::Area& message, const MapProfile& profile) {
  if (message.has_tiles()) {
    const auto& keys = message.tiles().keys();
    return SyncArea::OfTiles({keys.begin(), keys.end()}, profile);
  }
  Result<MapArea> shape = ShapeFromWire(message);
  if (!shape) {
    return Error(shape.error());
  }
  return SyncArea::Create(*std::move(shape), profile);
}

Result<SyncRequest> SyncFromWire(const wire::SyncRequest& message, const StoreIdentity& atlas) {
  Result<SyncArea> area = AreaFromWire(message.area(), atlas.profile);
  if (!area) {
    return Error(area.error());
  }
  const Result<SectionMask> sections = SectionsFromWire(message.sections());
  if (!sections) {
    return Error(sections.error());
  }
  Result<HeldTiles> held = HeldFromWire(message);
  if (!held) {
    return Error(held.error());
  }
  SyncRequest request{*std::move(area), message.finest_level(), message.coarsest_level(),
                      *sections,        *std::move(held),       std::nullopt};
  if (!message.cursor().empty()) {
    const Result<SyncCursor> cursor = CursorFromWire(message.cursor(), request, atlas);
    if (!cursor) {
      return Error(cursor.error());
    }
    request.after = *cursor;
  }
  return request;
}

Result<SyncRequest> TakeSync(wire::SyncRequest& message, const StoreIdentity& atlas) {
  wire::SyncRequest taken;  // cleared, fields that are repeated would keep their memory
  taken.Swap(&message);
  message.set_budget_bytes(taken.budget_bytes());
  message.set_timeout_ms(taken.timeout_ms());
  message.set_wait_revision(taken.wait_revision());
  message.set_takes_deltas(taken.takes_deltas());
  return SyncFromWire(taken, atlas);
}

std::string CursorToWire(const SyncCursor& cursor,
                         const SyncRequest& request,
                         const StoreIdentity& atlas) {
  ByteWriter out;
  out.U64(cursor.revision);
  out.U64(std::bit_cast<std::uint64_t>(cursor.priority));
  out.U64(cursor.key);
  out.U64(HashOfOrder(request, atlas));
  return BytesToWire(out.bytes());
}

SyncBytes BytesOf(const wire::SyncRequest& message) {
  constexpr std::size_t kOtherFields = 64;  // of a manifest: numbers and lengths
  const std::size_t tiles = CountOf(message, &wire::Held::keys_size);
  const std::size_t blocks = CountOf(message, &wire::Held::blocks_size);
  const auto area = static_cast<std::size_t>(message.area().tiles().keys_size());
  constexpr std::size_t kKeyBytes = sizeof(std::uint64_t);
  return {area * kKeyBytes + tiles * sizeof(HeldTile) + blocks * sizeof(HeldBlock),
          kOtherFields + (tiles + blocks) * kKeyBytes + (tiles + blocks) / 8};
}

void HoldingsToWire(const SyncPlan& plan, wire::SyncManifest& out) {
  out.mutable_removed()->Add(plan.removed.begin(), plan.removed.end());
  if (!plan.current_tiles.empty()) {
    out.set_current_tiles(BytesToWire(plan.current_tiles));
  }
  if (!plan.current_blocks.empty()) {
    out.set_current_blocks(BytesToWire(plan.current_blocks));
  }
  out.set_not_modified(plan.not_modified);
  out.mutable_differing_blocks()->Add(plan.differing.begin(), plan.differing.end());
}

void AnnounceTile(const TileBody& tile,
                  std::uint8_t level,
                  const MapProfile& profile,
                  wire::SyncManifest& out) {
  out.add_keys(tile.id().key);
  out.add_revisions(tile.id().revision);
  out.add_payload_hashes(tile.id().payload_hash);
  out.add_bytes(static_cast<std::uint32_t>(tile.blob().size()));
  out.add_errors_mm(static_cast<std::uint32_t>(std::lround(1e3 * GeometricError(level, profile))));
}

}  // namespace atlas
