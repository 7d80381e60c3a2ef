#include "core/fusion/cell_layers.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "core/base/integer_math.h"
#include "core/fusion/label_walk.h"
#include "core/tile/tile.h"

namespace atlas {
namespace {

std::int64_t Distance(std::int32_t a, std::int32_t b) {
  return std::abs(std::int64_t{a} - b);
}

}  // namespace

AltitudeEstimate CellLayerBuilder::Estimate(const Observation& observation) const {
  return {observation.altitude_mm,
          sigmas_.Sigma100um(observation.source, observation.distance_step)};
}

void CellLayerBuilder::Build(std::span<const Observation> observations) {
  const LayerMakers makers(observations, profile_);
  FindRepresentatives(observations, makers, input_, profile_, representatives_);
  ChainRepresentatives(observations);
  LabelAndSum(observations, makers);
  PublishLayers();
  RelabelObservations();
  AdoptWeak(observations, makers);
}

// Eq. 1 over the representatives of all sessions, sorted by altitude.
void CellLayerBuilder::ChainRepresentatives(std::span<const Observation> observations) {
  const std::size_t count = representatives_.size();
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    const std::int32_t altitude_a = observations[representatives_[a].observation].altitude_mm;
    const std::int32_t altitude_b = observations[representatives_[b].observation].altitude_mm;
    return altitude_a != altitude_b ? altitude_a < altitude_b : a < b;
  });
  estimates_.clear();
  for (const std::uint32_t index : order_) {
    estimates_.push_back(Estimate(observations[representatives_[index].observation]));
  }
  chain_labels_.resize(count);
  const std::uint32_t layer_count = ChainLayers(estimates_, profile_, chain_labels_);
  for (std::size_t i = 0; i < count; ++i) {
    representatives_[order_[i]].layer = chain_labels_[i];
  }
  PrepareSums(observations, layer_count);
}

void CellLayerBuilder::PrepareSums(std::span<const Observation> observations,
                                   std::uint32_t layer_count) {
  sums_.assign(layer_count, {});
  for (std::size_t i = order_.size(); i-- > 0;) {  // the lowest one stays as reference
    sums_[chain_labels_[i]].reference_mm = estimates_[i].altitude_mm;
  }
  for (std::size_t i = 0; i < order_.size(); ++i) {
    LayerSums& sums = sums_[chain_labels_[i]];
    const std::int64_t weight = Weight(observations[representatives_[order_[i]].observation]);
    sums.vehicle_weight += weight;
    sums.vehicle_moment += weight * (estimates_[i].altitude_mm - sums.reference_mm);
  }
  for (LayerSums& sums : sums_) {
    sums.provisional_mm = static_cast<std::int32_t>(
        sums.reference_mm + RoundDiv(sums.vehicle_moment, sums.vehicle_weight));
    sums.vehicle_weight = 0;
    sums.vehicle_moment = 0;
  }
}

// Eq. 2 and the sums of eq. 3.
void CellLayerBuilder::LabelAndSum(std::span<const Observation> observations,
                                   const LayerMakers& makers) {
  labels_.assign(observations.size(), kNoLayer);
  LabelWalk walk(observations, representatives_);
  std::uint32_t vehicle = 0;
  for (std::uint32_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    if (!makers.Contains(observation)) {
      continue;
    }
    const std::uint32_t session = input_.frames[observation.frame].session;
    if (input_.sessions[session].vehicle != vehicle) {
      CloseVehicle();
      vehicle = input_.sessions[session].vehicle;
    }
    const std::uint32_t layer = Gate(walk.Label(i, session), observation.altitude_mm);
    labels_[i] = layer;
    if (layer != kNoLayer) {
      LayerSums& sums = sums_[layer];
      const std::int64_t weight = Weight(observation);
      sums.vehicle_weight += weight;
      sums.vehicle_moment += weight * (observation.altitude_mm - sums.reference_mm);
      ++sums.observations;
      sums.is_measured |= observation.is_strong();
    }
  }
  CloseVehicle();
}

// An observation far from the layer that eq. 2 gives it goes to the nearest one within the gate, or
// nowhere.
std::uint32_t CellLayerBuilder::Gate(std::uint32_t layer, std::int32_t altitude_mm) const {
  if (profile_.preset == FusionPreset::kPaper ||
      Distance(sums_[layer].provisional_mm, altitude_mm) < profile_.other_layer_mm) {
    return layer;
  }
  std::uint32_t nearest = kNoLayer;
  std::int64_t nearest_distance = profile_.other_layer_mm;
  for (std::uint32_t i = 0; i < sums_.size(); ++i) {
    const std::int64_t distance = Distance(sums_[i].provisional_mm, altitude_mm);
    if (distance < nearest_distance) {
      nearest = i;
      nearest_distance = distance;
    }
  }
  return nearest;
}

// Adds one vehicle's sums, scaled down to the cap where they exceed it.
void CellLayerBuilder::CloseVehicle() {
  for (LayerSums& sums : sums_) {
    if (sums.vehicle_weight > kVehicleWeightCap) {
      sums.vehicle_moment =
          RoundDiv128(Int128{sums.vehicle_moment} * kVehicleWeightCap, sums.vehicle_weight);
      sums.vehicle_weight = kVehicleWeightCap;
    }
    sums.weight += sums.vehicle_weight;
    sums.moment += sums.vehicle_moment;
    sums.vehicle_weight = 0;
    sums.vehicle_moment = 0;
  }
}

// Layers that kept an observation, lowest first; the best supported ones where there are too many.
void CellLayerBuilder::PublishLayers() {
  published_.clear();
  for (std::uint32_t i = 0; i < sums_.size(); ++i) {
    if (sums_[i].weight > 0) {
      LayerSums& sums = sums_[i];
      sums.provisional_mm =
          static_cast<std::int32_t>(sums.reference_mm + RoundDiv(sums.moment, sums.weight));
      published_.push_back(i);
    }
  }
  if (published_.size() > kMaxCellLayers) {
    std::stable_sort(published_.begin(), published_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return sums_[a].observations > sums_[b].observations;
    });
    published_.resize(kMaxCellLayers);
  }
  std::sort(published_.begin(), published_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return sums_[a].provisional_mm != sums_[b].provisional_mm
               ? sums_[a].provisional_mm < sums_[b].provisional_mm
               : a < b;
  });
  layers_.clear();
  for (const std::uint32_t index : published_) {
    const LayerSums& sums = sums_[index];
    layers_.push_back({sums.provisional_mm, sigmas_.SigmaOfWeight100um(sums.weight),
                       sums.is_measured, sums.observations});
  }
}

// From indices into sums_ to indices into layers_.
void CellLayerBuilder::RelabelObservations() {
  if (sums_.size() == 1 && published_.size() == 1) {
    return;
  }
  new_label_.assign(sums_.size(), kNoLayer);
  for (std::uint32_t label = 0; label < published_.size(); ++label) {
    new_label_[published_[label]] = label;
  }
  for (std::uint32_t& label : labels_) {
    label = label == kNoLayer ? kNoLayer : new_label_[label];
  }
}

// Observations that made no layer still say something about a layer near them.
void CellLayerBuilder::AdoptWeak(std::span<const Observation> observations,
                                 const LayerMakers& makers) {
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (makers.Contains(observations[i])) {
      continue;
    }
    labels_[i] = NearestPublished(observations[i].altitude_mm);
    if (labels_[i] != kNoLayer) {
      ++layers_[labels_[i]].observations;
    }
  }
}

std::uint32_t CellLayerBuilder::NearestPublished(std::int32_t altitude_mm) const {
  std::uint32_t nearest = kNoLayer;
  std::int64_t nearest_distance = profile_.other_layer_mm;
  for (std::uint32_t i = 0; i < layers_.size(); ++i) {
    const std::int64_t distance = Distance(layers_[i].altitude_mm, altitude_mm);
    if (distance < nearest_distance) {
      nearest = i;
      nearest_distance = distance;
    }
  }
  return nearest;
}

}  // namespace atlas
