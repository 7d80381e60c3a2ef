// Which segments of a map were changed, and what monitoring should call them.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/localization/monitor/contradiction.h"

namespace atlas::testing {

// Why a segment was changed.
enum class ChangePart : std::uint8_t { kColumns, kCars, kBuilding };
inline constexpr std::array<const char*, 3> kChangePartNames{"columns", "cars", "building"};

// Of one cell; segments as bits from `ChangedSegments::lowest` on.
struct ChangedCell {
  std::int64_t x = 0;  // world indices
  std::int64_t y = 0;
  std::uint64_t appeared = 0;  // taken out of the map
  std::uint64_t vanished = 0;  // put into it
  ChangePart part = ChangePart::kColumns;
  // Lower than this, world frame, returns are ground and no column (the profile's base offset above
  // the lowest layer that was changed).
  double foot_m = -1e9;

  std::uint64_t Of(ContradictionKind kind) const {
    return kind == ContradictionKind::kVanished ? vanished : appeared;
  }
};

struct ChangedSegments {
  std::int32_t lowest = 0;  // lattice index of bit 0; no world here is higher than 64 segments
  std::vector<ChangedCell> cells;
  std::unordered_map<std::uint64_t, std::uint32_t> by_place;

  void Add(const ChangedCell& cell) {
    by_place.emplace(Key(cell.x, cell.y), static_cast<std::uint32_t>(cells.size()));
    cells.push_back(cell);
  }
  // Null where nothing was changed.
  const ChangedCell* At(std::int64_t x, std::int64_t y) const {
    const auto found = by_place.find(Key(x, y));
    return found == by_place.end() ? nullptr : &cells[found->second];
  }
  // Bits of the segments that [low_mm, high_mm) touches.
  std::uint64_t Between(std::int64_t low_mm, std::int64_t high_mm, std::int64_t height_mm) const {
    std::uint64_t bits = 0;
    for (std::int64_t k = 0; k < 64; ++k) {
      const std::int64_t bottom_mm = (lowest + k) * height_mm;
      bits |= bottom_mm < high_mm && bottom_mm + height_mm > low_mm ? std::uint64_t{1} << k : 0;
    }
    return bits;
  }

 private:
  static std::uint64_t Key(std::int64_t x, std::int64_t y) {
    return (static_cast<std::uint64_t>(x) << 32) ^ static_cast<std::uint32_t>(y);
  }
};

}  // namespace atlas::testing
