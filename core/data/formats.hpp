#pragma once
/// \file The file formats of the nouns as tables (see core/yaml/schema.hpp), and scenes that sit inside other
/// files.

#include <optional>
#include <string>

#include "core/data/scene.hpp"
#include "core/yaml/schema.hpp"

namespace hemowalk::data {

const yaml::Field& scene_format();
const yaml::Field& transport_law_format();

/// The scene in \p root, a document or a part of one; file names in it are relative to \p folder.
/// Adds all problems to \p problems; no scene if there is any.
std::optional<Scene> scene_from(yaml::Node root, const std::string& folder, yaml::Problems& problems);

/// The folder that file names inside \p file are relative to.
std::string folder_of(const std::string& file);
/// \p name as an absolute path, relative names starting at \p folder.
std::string resolved_path(const std::string& folder, const std::string& name);

}  // namespace hemowalk::data
