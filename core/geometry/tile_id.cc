#include "core/geometry/tile_id.h"

#include <cassert>
#include <ostream>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

std::uint64_t Gather(std::uint64_t v) {
  v &= 0x5555555555555555ULL;
  v = (v | (v >> 1)) & 0x3333333333333333ULL;
  v = (v | (v >> 2)) & 0x0F0F0F0F0F0F0F0FULL;
  v = (v | (v >> 4)) & 0x00FF00FF00FF00FFULL;
  v = (v | (v >> 8)) & 0x0000FFFF0000FFFFULL;
  return (v | (v >> 16)) & 0x00000000FFFFFFFFULL;
}

std::int32_t Unbias(std::uint64_t bits) {
  return static_cast<std::int32_t>(bits) + TileId::kMinCoordinate;
}

}  // namespace

Result<TileId> TileId::FromKey(std::uint64_t key) {
  if ((key >> 63) != 0) {
    return Error(StatusCode::kInvalidData, StrCat("tile key ", key, " is out of range"));
  }
  const std::uint64_t morton = key & ((std::uint64_t{1} << kLevelShift) - 1);
  return TileId{static_cast<std::uint8_t>(key >> kLevelShift), Unbias(Gather(morton)),
                Unbias(Gather(morton >> 1))};
}

TileId TileId::Parent() const {
  return {static_cast<std::uint8_t>(level + 1), x >> 1, y >> 1};  // arithmetic shift: floor
}

std::array<TileId, 4> TileId::Children() const {
  assert(level > 0);
  const auto child = static_cast<std::uint8_t>(level - 1);
  return {TileId{child, 2 * x, 2 * y}, TileId{child, 2 * x + 1, 2 * y},
          TileId{child, 2 * x, 2 * y + 1}, TileId{child, 2 * x + 1, 2 * y + 1}};
}

std::ostream& operator<<(std::ostream& out, const TileId& id) {
  return out << int{id.level} << '/' << id.x << '/' << id.y;
}

}  // namespace atlas
