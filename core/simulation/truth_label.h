// What a simulated point truly is: a SemanticKITTI class in the low 16 bits and, in the high 16,
// the deck that the surface belongs to (0 = the lowest; a ramp belongs to the deck it rises from).
#pragma once

#include <cstdint>

namespace atlas {

// Frozen: SemanticKITTI's numbers.
enum class TruthClass : std::uint16_t {
  kCar = 10,
  kRoad = 40,
  kParking = 44,
  kSidewalk = 48,
  kOtherGround = 49,
  kBuilding = 50,
  kFence = 51,
  kOtherStructure = 52,
  kVegetation = 70,
  kTrunk = 71,
  kTerrain = 72,
  kPole = 80,
  kTrafficSign = 81,
  kMovingCar = 252,
  kMovingPerson = 254,
};

constexpr std::uint32_t TruthLabel(TruthClass truth_class, std::uint32_t deck = 0) {
  return static_cast<std::uint32_t>(truth_class) | (deck << 16);
}

constexpr TruthClass ClassOfLabel(std::uint32_t label) {
  return static_cast<TruthClass>(label & 0xFFFF);
}

constexpr std::uint32_t DeckOfLabel(std::uint32_t label) {
  return label >> 16;
}

// SemanticKITTI numbers what moves from 252 on.
constexpr bool IsMovingLabel(std::uint32_t label) {
  return (label & 0xFFFF) >= 252;
}

// What a vehicle may stand on (the segmentation protocol's ground).
constexpr bool IsGroundLabel(std::uint32_t label) {
  switch (ClassOfLabel(label)) {
    case TruthClass::kRoad:
    case TruthClass::kParking:
    case TruthClass::kSidewalk:
    case TruthClass::kOtherGround:
    case TruthClass::kTerrain:
      return true;
    default:
      return false;
  }
}

}  // namespace atlas
