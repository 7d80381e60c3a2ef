// The surface layers of one cell: paper III-C, eq. 1 to 3, in integers.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/fusion/fusion_input.h"
#include "core/fusion/observation.h"
#include "core/fusion/segments.h"
#include "core/fusion/sigma_table.h"
#include "core/tile/layer_association.h"

namespace atlas {

// One vehicle's observations of a layer weigh at most as much as this many measured at the sensor.
inline constexpr std::int64_t kVehicleWeightCap = 64 * kUnitWeight;

struct CellLayer {
  std::int32_t altitude_mm = 0;
  std::uint16_t sigma_100um = 0;
  bool is_measured = false;        // by at least one strong observation
  std::uint32_t observations = 0;  // that belong to it
};

inline constexpr std::uint32_t kNoLayer = std::numeric_limits<std::uint32_t>::max();

// Reused from cell to cell: holds scratch memory that grows to the largest cell.
class CellLayerBuilder {
 public:
  // All three must outlive the builder.
  CellLayerBuilder(const FusionInput& input, const SigmaTable& sigmas, const MapProfile& profile)
      : input_(input), sigmas_(sigmas), profile_(profile) {}

  // Observations in canonical order. Their layers, lowest first and at most kMaxCellLayers, and
  // for each observation its layer or kNoLayer are then in layers() and labels().
  void Build(std::span<const Observation> observations);

  std::span<const CellLayer> layers() const { return layers_; }
  std::span<const std::uint32_t> labels() const { return labels_; }

 private:
  // What eq. 3 sums. Altitudes are taken from `reference_mm`, a representative's, to stay small.
  struct LayerSums {
    std::int32_t reference_mm = 0;
    std::int32_t provisional_mm = 0;  // weighted mean of the representatives
    std::int64_t vehicle_weight = 0;  // of the vehicle being summed
    std::int64_t vehicle_moment = 0;
    std::int64_t weight = 0;
    std::int64_t moment = 0;
    std::uint32_t observations = 0;
    bool is_measured = false;
  };

  std::int64_t Weight(const Observation& observation) const {
    return sigmas_.Weight(observation.source, observation.distance_step);
  }
  AltitudeEstimate Estimate(const Observation& observation) const;

  void ChainRepresentatives(std::span<const Observation> observations);
  void PrepareSums(std::span<const Observation> observations, std::uint32_t layer_count);
  void LabelAndSum(std::span<const Observation> observations, const LayerMakers& makers);
  std::uint32_t Gate(std::uint32_t layer, std::int32_t altitude_mm) const;
  void CloseVehicle();
  void PublishLayers();
  void RelabelObservations();
  void AdoptWeak(std::span<const Observation> observations, const LayerMakers& makers);
  std::uint32_t NearestPublished(std::int32_t altitude_mm) const;

  const FusionInput& input_;
  const SigmaTable& sigmas_;
  const MapProfile& profile_;

  std::vector<Representative> representatives_;
  std::vector<std::uint32_t> order_;  // of representatives by altitude
  std::vector<AltitudeEstimate> estimates_;
  std::vector<std::uint32_t> chain_labels_;
  std::vector<LayerSums> sums_;
  std::vector<std::uint32_t> published_;  // index into sums_ of each layer, then kept layers only
  std::vector<std::uint32_t> new_label_;  // of each entry of sums_
  std::vector<CellLayer> layers_;
  std::vector<std::uint32_t> labels_;
};

}  // namespace atlas
