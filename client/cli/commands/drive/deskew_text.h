// What `--deskew auto` found out about a drive, for people and programs.
#pragma once

#include <string>

#include <boost/json/object.hpp>

#include "client/drive/drive_skew.h"

namespace atlas {

// Both: of one that was looked at (`skew`).
boost::json::object DeskewJson(const DeskewDecision& decision);
std::string DeskewText(const DeskewDecision& decision);

}  // namespace atlas
