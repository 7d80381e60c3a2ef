#include "client/atlas_file/atlas_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "client/map/cell_address.h"
#include "client/vehicle/area_touch.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/store_snapshot.h"

namespace atlas {
namespace {

// So that tiles that only end at the box are listed, however its numbers were rounded.
constexpr double kEdge_m = 1e-5;

std::int32_t TileCoordinate(double position_m, double side_m) {
  return static_cast<std::int32_t>(std::clamp<double>(
      std::floor(position_m / side_m), TileId::kMinCoordinate, TileId::kMaxCoordinate));
}

TileRect RectAround(const BoxArea& box, std::uint8_t level, const MapProfile& profile) {
  const double side_m = TileSideMetres(level, profile);
  TileRect rect{level};
  rect.min_x = TileCoordinate(box.min_m.x() - kEdge_m, side_m);
  rect.min_y = TileCoordinate(box.min_m.y() - kEdge_m, side_m);
  rect.max_x = TileCoordinate(box.max_m.x() + kEdge_m, side_m);
  rect.max_y = TileCoordinate(box.max_m.y() + kEdge_m, side_m);
  return rect;
}

BoxArea BoxAround(const DiscArea& disc) {
  const Eigen::Vector2d reach_m = Eigen::Vector2d::Constant(disc.radius_m);
  return {disc.center_m - reach_m, disc.center_m + reach_m};
}

BoxArea Everywhere() {
  const auto far_m = Eigen::Vector2d::Constant(std::numeric_limits<double>::max());
  return {-far_m, far_m};
}

Status CheckBox(const BoxArea& box) {
  return box.min_m.array().isNaN().any() || box.max_m.array().isNaN().any()
             ? Status(StatusCode::kInvalidArgument, "atlas file: a place is not a number")
             : Status();
}

}  // namespace

AtlasFile::AtlasFile(std::unique_ptr<StoreSnapshot> snapshot) : snapshot_(std::move(snapshot)) {
  const StoreIdentity& identity = snapshot_->identity();
  key_ = {Bytes(identity.atlas_id.begin(), identity.atlas_id.end()), identity.profile};
}
AtlasFile::AtlasFile(AtlasFile&&) noexcept = default;
AtlasFile& AtlasFile::operator=(AtlasFile&&) noexcept = default;
AtlasFile::~AtlasFile() = default;

Result<AtlasFile> AtlasFile::Open(const std::filesystem::path& file) {
  Result<StoreSnapshot> snapshot = StoreSnapshot::Open(file);
  if (!snapshot) return Error(snapshot.error());
  return AtlasFile(std::make_unique<StoreSnapshot>(*std::move(snapshot)));
}

std::uint64_t AtlasFile::revision() const {
  return snapshot_->state().revision;
}

std::uint64_t AtlasFile::dirty_tiles() const {
  return snapshot_->state().dirty_tiles;
}

Result<bool> AtlasFile::HasTiles() {
  bool has_tiles = false;
  const Status status = List(0, Everywhere(), [&has_tiles](const TileFacts&) {
    has_tiles = true;
    return Status(StatusCode::kConflict, "one is enough");
  });
  if (!has_tiles && !status.ok()) return Error(status);
  return has_tiles;
}

Status AtlasFile::ReadLevel(std::uint8_t level,
                            const std::optional<DiscArea>& disc,
                            const OnTile& on_tile) {
  const BoxArea box = disc ? BoxAround(*disc) : Everywhere();
  return List(level, box, [&](const TileFacts& facts) -> Status {
    if (disc && !Touches(*disc, facts.id, profile())) return {};
    const Result<TileBlob> tile = ReadListed(facts.id);
    return tile ? on_tile(*tile) : tile.error();
  });
}

Result<std::optional<TileBlob>> AtlasFile::Read(const TileId& id) {
  Result<std::optional<StoredTile>> stored = snapshot_->ReadTile(id);
  if (!stored) return Error(stored.error());
  if (!*stored) return std::nullopt;
  StoredTile& tile = **stored;
  return TileBlob{tile.id, tile.revision, tile.payload_hash, std::move(tile.blob)};
}

Result<TileBlob> AtlasFile::ReadListed(const TileId& id) {
  Result<std::optional<TileBlob>> tile = Read(id);
  if (!tile) return Error(tile.error());
  if (*tile) return **std::move(tile);
  return Error(StatusCode::kInvalidData,
               StrCat("atlas file: tile ", id, ": listed and not there; an index is damaged"));
}

Status AtlasFile::List(std::uint8_t level,
                       const BoxArea& box,
                       const std::function<Status(const TileFacts&)>& on_tile) {
  if (level >= profile().levels) {
    return {StatusCode::kInvalidArgument,
            StrCat("level ", int{level}, ": this atlas has levels 0 to ", profile().levels - 1)};
  }
  ATLAS_RETURN_IF_ERROR(CheckBox(box));
  return snapshot_->ScanTiles(RectAround(box, level, profile()), [&](const TileSummary& tile) {
    return on_tile({tile.id, tile.revision, tile.payload_hash, kEverySection});
  });
}

}  // namespace atlas
