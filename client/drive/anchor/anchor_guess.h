// Where scans of a drive may be in a map, each by itself, and the transforms that several of them
// agree on.
#pragma once

#include <cstddef>
#include <vector>

#include "client/drive/anchor/anchor_fit.h"

namespace atlas {

struct AnchorGuess {
  std::size_t index = 0;  // of the scan; a scan may have several guesses
  FoundScan scan;
  bool is_believed = false;  // it was found there; else it only looks alike
};

std::vector<AnchorGuess> BelievedOf(const std::vector<AnchorGuess>& guesses);
// As LargestAgreement.
std::vector<AnchorGuess> AgreeingOf(const std::vector<AnchorGuess>& guesses,
                                    const AgreementOptions& options);

// The believed guesses that agree come first, and may be none. Then those that agree with none of
// the sets before and among themselves, of `min_scans` different scans at least: other places where
// the drive might be. `most` sets in all.
std::vector<std::vector<AnchorGuess>> CandidatesOf(std::vector<AnchorGuess> guesses,
                                                   const AgreementOptions& options,
                                                   std::size_t min_scans,
                                                   std::size_t most);

}  // namespace atlas
