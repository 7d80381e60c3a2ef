// A map against the truth, figure by figure (docs/results.md, "Accuracy").
#pragma once

#include <cstdint>
#include <span>

#include "tests/bench/accuracy/drive_map.h"
#include "tests/bench/accuracy/drive_truth.h"

namespace atlas::testing {

struct Share {
  std::uint64_t good = 0;
  std::uint64_t whole = 0;

  void Add(bool is_good) {
    good += is_good ? 1U : 0U;
    ++whole;
  }
  double value() const {
    return whole == 0 ? 1.0 : static_cast<double>(good) / static_cast<double>(whole);
  }
};

// Of truth (row) and map (column); a surface is unknown where the map has none or does not tell.
struct TraversabilityTable {
  std::uint64_t free_free = 0;
  std::uint64_t free_occupied = 0;
  std::uint64_t free_unknown = 0;
  std::uint64_t occupied_free = 0;
  std::uint64_t occupied_occupied = 0;
  std::uint64_t occupied_unknown = 0;
};

enum class CellVerdict : std::uint8_t { kRight, kMissing, kFewer, kMore };

struct AccuracyScore {
  // Cells all of whose surfaces that any beam hit are counted ones.
  Share layers_right;
  // Of the same, those that have each of these surfaces, and no layer that is not within 0.3 m of a
  // ground of its own that the world has there: fewer than three beams may have hit it, and the map
  // knows it from between rays.
  Share layers_real;
  std::uint64_t cells_missing = 0;
  std::uint64_t cells_fewer = 0;
  std::uint64_t cells_more = 0;
  Share surfaces_found;                 // of the counted ones: some layer lies within a metre
  double altitude_square_sum_m2 = 0.0;  // of those found
  Share altitude_within_30mm;           // of all

  Share moving_gone;          // in the column and on the surface
  Share moving_gone_columns;  // each alone
  Share moving_gone_surface;
  Share static_kept;
  Share static_kept_nearby;  // in the cell or one of its eight neighbours
  TraversabilityTable traversability;

  double altitude_rmse_m() const;
};

AccuracyScore ScoreMap(const DriveMap& map, const TruthMap& truth, const TruthOptions& options);

// Of a cell whose surfaces are all counted.
CellVerdict JudgeLayers(std::span<const TileLayer> layers, const CellTruth& truth);
bool IsDecided(const CellTruth& truth);
// Each surface has a layer, no two layers lie on one ground of the world, and none beside.
bool AreLayersReal(std::span<const TileLayer> layers, const CellTruth& truth);
// Is the layer nearest to `ground_m` occupied between two heights above it?
bool IsOccupied(
    const DriveMap& map, const MapCell& cell, double ground_m, double low_m, double high_m);

}  // namespace atlas::testing
