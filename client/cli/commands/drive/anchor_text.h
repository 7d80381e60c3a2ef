// What `atlas ingest --anchor` found out about the sessions of a drive, for people and programs.
#pragma once

#include <string>
#include <vector>

#include <boost/json/array.hpp>

#include "client/drive/anchor/session_anchor.h"
#include "core/base/status.h"

namespace atlas {

boost::json::array AnchorsJson(const std::vector<SessionAnchor>& anchors);
// One line.
std::string AnchorText(const SessionAnchor& anchor);
// kNotFound naming those of which nobody knows where they lie.
Status CheckAnchored(const std::vector<SessionAnchor>& anchors);

}  // namespace atlas
