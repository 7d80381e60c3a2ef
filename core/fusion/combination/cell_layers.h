// The surface layers of one cell: paper III-C, eq. 1 and 3, in integers.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/fusion/observation/sigma_table.h"
#include "core/fusion/segment/segment_view.h"
#include "core/tile/layer_association.h"

namespace atlas {

// One vehicle's observations of a layer weigh at most as much as this many measured at the sensor.
inline constexpr std::int64_t kVehicleWeightCap = 64 * kUnitWeight;

struct CellLayer {
  std::int32_t altitude_mm = 0;
  std::int32_t reference_mm = 0;  // the altitude of one of its segments
  std::uint16_t sigma_100um = 0;
  bool is_measured = false;        // by at least one strong observation
  std::uint32_t observations = 0;  // that belong to it
  std::int64_t last_time_ms = 0;   // of the keyframe that spoke of it last
};

inline constexpr std::uint32_t kNoLayer = std::numeric_limits<std::uint32_t>::max();

// Reused from cell to cell: holds scratch memory that grows to the largest cell.
class CellLayerBuilder {
 public:
  // Both must outlive the builder.
  CellLayerBuilder(const SigmaTable& sigmas, const MapProfile& profile)
      : sigmas_(sigmas), profile_(profile) {}

  // Segments in canonical order. Their layers, lowest first and at most kMaxCellLayers, and for
  // each segment its layer or kNoLayer are then in layers() and labels().
  void Build(std::span<const SegmentView> segments);

  std::span<const CellLayer> layers() const { return layers_; }
  std::span<const std::uint32_t> labels() const { return labels_; }

 private:
  struct LayerSums {
    std::int32_t reference_mm = 0;  // altitudes are taken from it to stay small
    std::int32_t altitude_mm = 0;
    std::int64_t vehicle_weight = 0;  // of the vehicle being summed
    std::int64_t vehicle_moment = 0;
    std::int64_t weight = 0;
    std::int64_t moment = 0;
    std::uint32_t observations = 0;
    bool is_measured = false;
    std::int64_t last_time_ms = 0;
  };

  // A segment that makes a layer, with others or alone.
  struct Maker {
    std::int32_t altitude_mm = 0;
    std::uint32_t index = 0;
  };

  bool IsMaker(const Segment& segment, std::span<const SegmentView> segments) const;
  void LabelMakers(std::span<const SegmentView> segments);
  void ChainMakers(std::span<const SegmentView> segments);
  void Sum(std::span<const SegmentView> segments);
  void CloseVehicle();
  void Publish();
  void Relabel();
  void AdoptWeak(std::span<const SegmentView> segments);
  std::uint32_t NearestLayer(std::int32_t altitude_mm) const;

  const SigmaTable& sigmas_;
  const MapProfile& profile_;

  std::vector<Maker> makers_;
  std::vector<AltitudeEstimate> estimates_;
  std::vector<std::uint32_t> chain_labels_;
  std::vector<LayerSums> sums_;
  std::vector<std::uint32_t> published_;  // index into sums_ of each layer
  std::vector<std::uint32_t> new_label_;  // of each entry of sums_
  std::vector<CellLayer> layers_;
  std::vector<std::uint32_t> labels_;
};

}  // namespace atlas
