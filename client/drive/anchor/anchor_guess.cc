#include "client/drive/anchor/anchor_guess.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

namespace atlas {
namespace {

std::size_t CountScans(const std::vector<AnchorGuess>& guesses) {
  std::set<std::size_t> scans;
  for (const AnchorGuess& guess : guesses) {
    scans.insert(guess.index);
  }
  return scans.size();
}

}  // namespace

std::vector<AnchorGuess> BelievedOf(const std::vector<AnchorGuess>& guesses) {
  std::vector<AnchorGuess> believed;
  std::copy_if(guesses.begin(), guesses.end(), std::back_inserter(believed),
               [](const AnchorGuess& guess) { return guess.is_believed; });
  return believed;
}

std::vector<AnchorGuess> AgreeingOf(const std::vector<AnchorGuess>& guesses,
                                    const AgreementOptions& options) {
  std::vector<FoundScan> scans;
  for (const AnchorGuess& guess : guesses) {
    scans.push_back(guess.scan);
  }
  std::vector<AnchorGuess> agreeing;
  for (const std::size_t i : LargestAgreement(scans, options)) {
    agreeing.push_back(guesses[i]);
  }
  return agreeing;
}

std::vector<std::vector<AnchorGuess>> CandidatesOf(std::vector<AnchorGuess> guesses,
                                                   const AgreementOptions& options,
                                                   std::size_t min_scans,
                                                   std::size_t most) {
  std::vector<std::vector<AnchorGuess>> candidates{AgreeingOf(BelievedOf(guesses), options)};
  while (candidates.size() < most) {
    const std::vector<AnchorGuess>& taken = candidates.back();
    std::erase_if(guesses, [&](const AnchorGuess& guess) {
      return std::any_of(taken.begin(), taken.end(), [&](const AnchorGuess& other) {
        return Agree(guess.scan, other.scan, options);
      });
    });
    std::vector<AnchorGuess> rival = AgreeingOf(guesses, options);
    if (CountScans(rival) < min_scans) break;
    candidates.push_back(std::move(rival));
  }
  return candidates;
}

}  // namespace atlas
