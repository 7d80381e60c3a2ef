// One cell of the plain fusion: from its segments to its layers.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "core/fusion/observation/sigma_table.h"
#include "core/fusion/tile_fusion.h"
#include "tests/core/fusion/oracle/plain_survey.h"

namespace atlas::testing {

class PlainSum;

class PlainCell {
 public:
  PlainCell(const MapProfile& profile, const SigmaTable& sigmas)
      : profile_(profile), sigmas_(sigmas), survey_(profile, sigmas) {}

  // The layers of a cell from its observations in canonical order, lowest first; adds to `used` a
  // key of each session that took part.
  void Fuse(std::span<const PlainObservation> observations,
            std::set<const SessionKey*>& used,
            std::vector<TileLayer>& out);

 private:
  using Segment = PlainSegment;
  struct Layer {
    int chained = 0;  // its number in the chain
    std::int64_t altitude_mm = 0;
    std::int64_t weight = 0;
    std::int64_t observations = 0;
    std::int64_t time_ms = 0;
    bool is_measured = false;
  };

  void KeepLatest();
  bool IsAlone(const Segment& segment) const;
  void ChainLayers();
  void SumLayer(Layer& layer) const;
  void KeepBestLayers();
  void AdoptWeak();
  TileLayer Publish(std::size_t index) const;
  std::size_t PublishedSegments(std::size_t index, std::int64_t base) const;
  void AddToColumn(const Segment& segment,
                   std::int64_t base,
                   bool is_foot_gone,
                   std::span<PlainSum> column) const;

  const MapProfile& profile_;
  const SigmaTable& sigmas_;
  PlainSurvey survey_;
  std::span<Segment> segments_;
  std::vector<Segment*> makers_;
  std::vector<Layer> layers_;
};

}  // namespace atlas::testing
