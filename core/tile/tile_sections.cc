#include "core/tile/tile_sections.h"

#include <algorithm>
#include <array>
#include <span>

#include "core/base/planes.h"
#include "core/base/str_cat.h"
#include "core/tile/sigma_code.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxNameBytes = 64;
constexpr std::uint8_t kKnownFlags =
    TileLayer::kTraversable | TileLayer::kTraversableAny | TileLayer::kMeasured;

Status Damaged(const char* what) {
  return Status(StatusCode::kInvalidData, StrCat("tile: ", what));
}

// Visits the layers with the layer that each one's fields are written against: the last of the same
// order (lowest, second lowest, ...) in the row, for a row's first of an order the first of that
// order in an earlier row. `Layer` is TileLayer or const TileLayer.
template <typename Layer, typename Visit>
void VisitWithPredictor(const std::vector<std::uint32_t>& cell_begin,
                        std::size_t side,
                        std::span<Layer> layers,
                        const Visit& visit) {
  std::array<TileLayer, kMaxCellLayers> row_first{};
  for (std::size_t row = 0; row < side; ++row) {
    std::array<TileLayer, kMaxCellLayers> previous = row_first;
    std::array<bool, kMaxCellLayers> is_first{};
    is_first.fill(true);
    for (std::size_t cell = row * side; cell < (row + 1) * side; ++cell) {
      for (std::uint32_t i = cell_begin[cell]; i < cell_begin[cell + 1]; ++i) {
        const std::size_t order = i - cell_begin[cell];
        visit(layers[i], previous[order]);
        previous[order] = layers[i];
        row_first[order] = is_first[order] ? layers[i] : row_first[order];
        is_first[order] = false;
      }
    }
  }
}

// Differences wrap at 32, 16 and 8 bits.
std::uint32_t Difference32(std::int32_t value, std::int32_t previous) {
  return Zigzag(static_cast<std::int32_t>(static_cast<std::uint32_t>(value) -
                                          static_cast<std::uint32_t>(previous)));
}
std::int32_t Add32(std::int32_t previous, std::uint32_t zigzag) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(previous) +
                                   static_cast<std::uint32_t>(Unzigzag(zigzag)));
}
std::uint32_t Difference8(std::uint8_t value, std::uint8_t previous) {
  return Zigzag(static_cast<std::int8_t>(value - previous));
}
// A code that no sigma has gives 0, which no layer may have.
std::uint16_t AddSigma(std::uint16_t previous, std::uint32_t zigzag) {
  const auto code = static_cast<std::uint8_t>(CodeOfSigma(previous) + Unzigzag(zigzag));
  return code <= kMaxSigmaCode ? SigmaOfCode(code) : std::uint16_t{0};
}
std::uint32_t Difference16(std::uint16_t value, std::uint16_t previous) {
  return Zigzag(static_cast<std::int16_t>(value - previous));
}
std::uint16_t Add16(std::uint16_t previous, std::uint32_t zigzag) {
  return static_cast<std::uint16_t>(previous + Unzigzag(zigzag));
}

struct LayerPlanes {
  std::vector<std::uint32_t> altitudes;
  std::vector<std::uint32_t> sigmas;
  std::vector<std::uint32_t> observations;
  std::vector<std::uint32_t> occupancies;
  std::vector<std::uint32_t> flags;

  void Reserve(std::size_t count) {
    for (auto* plane : {&altitudes, &sigmas, &observations, &occupancies, &flags}) {
      plane->reserve(count);
    }
  }
};

LayerPlanes SplitLayers(const Tile& tile, std::size_t side) {
  LayerPlanes planes;
  planes.Reserve(tile.layers.size());
  VisitWithPredictor(
      tile.cell_begin, side, std::span(tile.layers),
      [&](const TileLayer& layer, const TileLayer& previous) {
        planes.altitudes.push_back(Difference32(layer.altitude_mm, previous.altitude_mm));
        planes.sigmas.push_back(
            Difference8(CodeOfSigma(layer.sigma_100um), CodeOfSigma(previous.sigma_100um)));
        planes.observations.push_back(Difference16(layer.observations, previous.observations));
        planes.occupancies.push_back(static_cast<std::uint8_t>(layer.occupancy));
        planes.flags.push_back(layer.flags);
      });
  return planes;
}

void JoinLayers(const LayerPlanes& planes, std::size_t side, Tile& tile) {
  std::size_t next = 0;
  VisitWithPredictor(tile.cell_begin, side, std::span(tile.layers),
                     [&](TileLayer& layer, const TileLayer& previous) {
                       layer.altitude_mm = Add32(previous.altitude_mm, planes.altitudes[next]);
                       layer.sigma_100um = AddSigma(previous.sigma_100um, planes.sigmas[next]);
                       layer.observations = Add16(previous.observations, planes.observations[next]);
                       layer.occupancy = static_cast<std::int8_t>(planes.occupancies[next]);
                       layer.flags = static_cast<std::uint8_t>(planes.flags[next]);
                       ++next;
                     });
}

Status ReadLayerCounts(ByteReader& in, std::size_t cells, Tile& tile) {
  const ByteSpan counts = in.Raw(cells);
  if (!in.ok()) {
    return Damaged("layer counts are truncated");
  }
  tile.cell_begin.assign(cells + 1, 0);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    if (counts[cell] > kMaxCellLayers) {
      return Status(StatusCode::kInvalidData,
                    StrCat("tile: cell ", cell, " has ", int{counts[cell]}, " layers, at most ",
                           kMaxCellLayers));
    }
    tile.cell_begin[cell + 1] = tile.cell_begin[cell] + counts[cell];
  }
  return {};
}

Status CheckLayers(const Tile& tile) {
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    const std::span<const TileLayer> layers = tile.Layers(cell);
    if (!std::is_sorted(layers.begin(), layers.end(), [](const TileLayer& a, const TileLayer& b) {
          return a.altitude_mm < b.altitude_mm;
        })) {
      return Status(StatusCode::kInvalidData,
                    StrCat("tile: layers of cell ", cell, " are not lowest first"));
    }
  }
  const bool is_valid = std::all_of(tile.layers.begin(), tile.layers.end(), [](const auto& l) {
    return (l.flags & ~kKnownFlags) == 0 && l.sigma_100um != 0 &&
           l.altitude_mm >= -kMaxAltitude_mm && l.altitude_mm <= kMaxAltitude_mm;
  });
  return is_valid ? Status() : Damaged("a layer has unknown flags, no sigma or is off the world");
}

}  // namespace

Bytes EncodeContributors(const Tile& tile) {
  ByteWriter out;
  out.Varint(tile.contributors.size());
  for (const SessionKey& key : tile.contributors) {
    out.String(key.vehicle);
    out.String(key.session);
  }
  return out.Take();
}

Bytes EncodeSurface(const Tile& tile, const MapProfile& profile) {
  ByteWriter out;
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    out.U8(static_cast<std::uint8_t>(tile.cell_begin[cell + 1] - tile.cell_begin[cell]));
  }
  const LayerPlanes planes = SplitLayers(tile, profile.tile_cells);
  WritePlanes(planes.altitudes, 4, out);
  WritePlanes(planes.sigmas, 1, out);
  WritePlanes(planes.observations, 2, out);
  WritePlanes(planes.occupancies, 1, out);
  WritePlanes(planes.flags, 1, out);
  return out.Take();
}

Bytes EncodeColumns(const Tile& tile, const MapProfile& profile) {
  Bytes has_column;
  std::vector<std::uint64_t> columns;
  has_column.reserve(tile.layers.size());
  for (const TileLayer& layer : tile.layers) {
    has_column.push_back(layer.column != 0 ? 1 : 0);
    if (layer.column != 0) {
      columns.push_back(layer.column);
    }
  }
  ByteWriter out;
  WriteBits(has_column, out);
  WriteNibblePlanes(columns, profile.column_segments, out);
  return out.Take();
}

Bytes EncodeConfirmed(const Tile& tile, const MapProfile& profile) {
  std::vector<std::uint32_t> differences;
  differences.reserve(tile.layers.size());
  VisitWithPredictor(tile.cell_begin, profile.tile_cells, std::span(tile.layers),
                     [&](const TileLayer& layer, const TileLayer& previous) {
                       differences.push_back(Zigzag(
                           static_cast<std::int32_t>(layer.confirmed_s - previous.confirmed_s)));
                     });
  ByteWriter out;
  WritePlanes(differences, 4, out);
  return out.Take();
}

Status DecodeContributors(ByteSpan section, Tile& tile) {
  ByteReader in(section);
  const std::uint64_t count = in.Varint();
  if (!in.ok() || count > section.size() / 4) {  // two names of at least one byte each
    return Damaged("contributors are truncated");
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    SessionKey key;
    key.vehicle = in.String(kMaxNameBytes);
    key.session = in.String(kMaxNameBytes);
    if (!in.ok() || !key.Validate().ok()) {
      return Damaged("a contributor's name is truncated or not a name");
    }
    if (!tile.contributors.empty() && !(tile.contributors.back() < key)) {
      return Damaged("contributors are not sorted");
    }
    tile.contributors.push_back(std::move(key));
  }
  return in.remaining() == 0 ? Status() : Damaged("bytes are left after the contributors");
}

Status DecodeSurface(ByteSpan section, const MapProfile& profile, Tile& tile) {
  constexpr std::size_t kLayerBytes = 4 + 1 + 2 + 1 + 1;
  const std::size_t side = profile.tile_cells;
  ByteReader in(section);
  ATLAS_RETURN_IF_ERROR(ReadLayerCounts(in, side * side, tile));
  const std::size_t count = tile.cell_begin.back();
  if (in.remaining() != count * kLayerBytes) {
    return Status(StatusCode::kInvalidData, StrCat("tile: ", in.remaining(), " bytes for ", count,
                                                   " layers, expected ", count * kLayerBytes));
  }
  LayerPlanes planes;
  planes.altitudes = ReadPlanes(in, count, 4);
  planes.sigmas = ReadPlanes(in, count, 1);
  planes.observations = ReadPlanes(in, count, 2);
  planes.occupancies = ReadPlanes(in, count, 1);
  planes.flags = ReadPlanes(in, count, 1);
  tile.layers.resize(count);
  JoinLayers(planes, side, tile);
  return CheckLayers(tile);
}

Status DecodeColumns(ByteSpan section, const MapProfile& profile, Tile& tile) {
  ByteReader in(section);
  const Bytes has_column = ReadBits(in, tile.layers.size());
  if (!in.ok()) {
    return Damaged("column bitmap is truncated");
  }
  const auto count =
      static_cast<std::size_t>(std::count(has_column.begin(), has_column.end(), std::uint8_t{1}));
  if (in.remaining() != (count + 1) / 2 * profile.column_segments) {
    return Damaged("columns are truncated or bytes are left");
  }
  std::vector<std::uint64_t> columns(count);
  ReadNibblePlanes(in, profile.column_segments, columns);
  if (!in.ok() || std::count(columns.begin(), columns.end(), std::uint64_t{0}) != 0) {
    return Damaged("columns are not in their one encoding");
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < tile.layers.size(); ++i) {
    tile.layers[i].column = has_column[i] != 0 ? columns[next++] : 0;
  }
  return {};
}

Status DecodeConfirmed(ByteSpan section, const MapProfile& profile, Tile& tile) {
  ByteReader in(section);
  const std::vector<std::uint32_t> differences = ReadPlanes(in, tile.layers.size(), 4);
  if (!in.ok() || in.remaining() != 0) {
    return Damaged("times are truncated or bytes are left");
  }
  std::size_t next = 0;
  VisitWithPredictor(tile.cell_begin, profile.tile_cells, std::span(tile.layers),
                     [&](TileLayer& layer, const TileLayer& previous) {
                       layer.confirmed_s = previous.confirmed_s +
                                           static_cast<std::uint32_t>(Unzigzag(differences[next]));
                       ++next;
                     });
  return {};
}

}  // namespace atlas
