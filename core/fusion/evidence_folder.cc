#include "core/fusion/evidence_folder.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace atlas {
namespace {

std::int16_t AddSaturating(std::int16_t a, std::int16_t b, std::int16_t clamp) {
  const int sum = a + b;
  return static_cast<std::int16_t>(std::clamp<int>(sum, -clamp, clamp));
}

std::uint8_t FlagsOf(const CellLayer& layer, std::int16_t occupancy) {
  const bool is_free = occupancy < 0;
  return static_cast<std::uint8_t>(
      (is_free ? TileLayer::kTraversable | TileLayer::kTraversableAny : 0) |
      (layer.is_measured ? TileLayer::kMeasured : 0));
}

}  // namespace

EvidenceFolder::EvidenceFolder(const FusionInput& input, const MapProfile& profile)
    : input_(input),
      profile_(profile),
      occupancy_units_{0, profile.miss_units, profile.hit_units},
      contributed_(input.sessions.size(), false) {}

void EvidenceFolder::Fold(std::span<const Observation> observations,
                          std::span<const std::uint32_t> labels,
                          std::span<const CellLayer> layers,
                          std::vector<TileLayer>& out) {
  PrepareSpans(layers);
  increments_.clear();
  std::size_t begin = 0;
  while (begin < observations.size()) {
    const std::uint32_t session = input_.frames[observations[begin].frame].session;
    std::size_t end = begin + 1;
    while (end < observations.size() && input_.frames[observations[end].frame].session == session) {
      ++end;
    }
    FoldSession(observations.subspan(begin, end - begin), labels.subspan(begin, end - begin),
                session);
    begin = end;
  }
  Publish(layers, out);
}

void EvidenceFolder::PrepareSpans(std::span<const CellLayer> layers) {
  spans_.clear();
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const std::int32_t* above = i + 1 < layers.size() ? &layers[i + 1].altitude_mm : nullptr;
    spans_.push_back(ColumnSpanOf(layers[i].altitude_mm, above, profile_));
  }
}

void EvidenceFolder::FoldSession(std::span<const Observation> observations,
                                 std::span<const std::uint32_t> labels,
                                 std::uint32_t session) {
  slots_.assign(spans_.size(), kNoLayer);
  if (input_.sessions[session].is_time_ordered) {
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (labels[i] != kNoLayer) {
        FoldObservation(observations[i], labels[i]);
      }
    }
  } else {
    SortByTime(observations);
    for (const std::uint32_t i : time_order_) {
      if (labels[i] != kNoLayer) {
        FoldObservation(observations[i], labels[i]);
      }
    }
  }
  const bool is_used = std::any_of(slots_.begin(), slots_.end(),
                                   [](std::uint32_t slot) { return slot != kNoLayer; });
  if (is_used) {
    contributed_[session] = true;
  }
}

void EvidenceFolder::SortByTime(std::span<const Observation> observations) {
  time_order_.resize(observations.size());
  std::iota(time_order_.begin(), time_order_.end(), 0u);
  std::sort(time_order_.begin(), time_order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return input_.frames[observations[a].frame].time_rank <
           input_.frames[observations[b].frame].time_rank;
  });
}

EvidenceFolder::Increment& EvidenceFolder::IncrementOf(std::uint32_t layer) {
  if (slots_[layer] == kNoLayer) {
    slots_[layer] = static_cast<std::uint32_t>(increments_.size());
    increments_.emplace_back().layer = layer;
  }
  return increments_[slots_[layer]];
}

void EvidenceFolder::FoldObservation(const Observation& observation, std::uint32_t layer) {
  Increment& increment = IncrementOf(layer);
  increment.last_time_rank = input_.frames[observation.frame].time_rank;
  increment.occupancy = AddSaturating(
      increment.occupancy, occupancy_units_[static_cast<std::size_t>(observation.occupancy)],
      profile_.session_clamp);
  if (observation.column == 0) {
    return;
  }
  const std::uint64_t nibbles =
      FitColumn(observation.column, observation.column_base, spans_[layer]);
  if (nibbles != 0) {
    increment.has_column = true;
    increment.column.AddNibbles(nibbles, {profile_.session_clamp, profile_.driven_clamp});
  }
}

void EvidenceFolder::Publish(std::span<const CellLayer> layers, std::vector<TileLayer>& out) {
  // Within a layer the last observation decides: ranks differ between sessions.
  std::sort(increments_.begin(), increments_.end(), [](const Increment& a, const Increment& b) {
    return a.layer != b.layer ? a.layer < b.layer : a.last_time_rank < b.last_time_rank;
  });
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < layers.size(); ++i) {
    std::int16_t occupancy = 0;
    bool has_column = false;
    ColumnEvidence column;
    for (; next < increments_.size() && increments_[next].layer == i; ++next) {
      const Increment& increment = increments_[next];
      occupancy = AddSaturating(occupancy, increment.occupancy, profile_.evidence_clamp);
      if (increment.has_column) {
        has_column = true;
        column.Add(increment.column, profile_.session_clamp, profile_.evidence_clamp);
      }
    }
    const CellLayer& layer = layers[i];
    constexpr std::uint32_t kMaxObservations = std::numeric_limits<std::uint16_t>::max();
    out.push_back({layer.altitude_mm, layer.sigma_100um, static_cast<std::int8_t>(occupancy),
                   FlagsOf(layer, occupancy),
                   static_cast<std::uint16_t>(std::min(layer.observations, kMaxObservations)),
                   has_column ? NibblesOfEvidence(column) : 0});
  }
}

}  // namespace atlas
