// A query of the past by one who has little time, beside digests of the past by another.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/status.h"

namespace atlas::testing {

struct AnswerFigures {
  std::vector<double> waits_ms;  // of each query, whatever the answer was
  int in_time = 0;               // of them were answered with tiles
};

// Queries of the finest tiles within 20 m of the middle of an atlas of `side` tiles along each
// side, at the revision of now, with 2 s for each; as whom `token` says. Beside them `digests` of
// that revision by whom `other_token` says, who has a day for each. kInvalidData: a digest was
// answered before the queries were.
Result<AnswerFigures> TimePast(std::uint16_t port,
                               int side,
                               const std::string& token,
                               const std::string& other_token,
                               int digests);

}  // namespace atlas::testing
