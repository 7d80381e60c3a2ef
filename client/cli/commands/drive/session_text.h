// What `atlas ingest` tells of the sessions that it uploaded to, as they are afterwards.
#pragma once

#include <ostream>

#include <boost/json/value.hpp>

#include "client/drive/lasting_upload.h"
#include "core/base/status.h"

namespace atlas {

// An array with an object for each; null where the daemon could not be asked.
boost::json::value SessionStatesJson(const LastingUploadReport& upload);

// kConflict: the daemon keeps one of them out of the map for how its poses look.
Status CheckNotQuarantined(const LastingUploadReport& upload);

// Notes for people: what the upload alone would not have left, and that nobody could be asked.
void PrintSessionNotes(const LastingUploadReport& upload, std::ostream& err);

}  // namespace atlas
