// Prints what Gazebo's own library makes of a description: one JSON object; complaints on stderr.
#include <iostream>
#include <sdf/sdf.hh>

int main(int, char **argv) {
  sdf::ParserConfig config;
  config.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::ERR);
  sdf::Root root;
  for (const auto &error : root.Load(argv[1], config)) std::cerr << error.Message() << "\n";
  const sdf::Model *model = root.Model();
  if (model == nullptr) return 1;
  std::cout << "{\"links\": {";
  for (uint64_t i = 0; i < model->LinkCount(); ++i) {
    const sdf::Link &link = *model->LinkByIndex(i);
    const auto &mass = link.Inertial().MassMatrix();
    std::cout << (i ? ", " : "") << "\"" << link.Name() << "\": {\"mass\": " << mass.Mass()
              << ", \"valid\": " << (mass.IsValid() ? "true" : "false")
              << ", \"bodies\": " << link.CollisionCount() << "}";
  }
  std::cout << "}, \"joints\": {";
  for (uint64_t i = 0; i < model->JointCount(); ++i) {
    const sdf::Joint &joint = *model->JointByIndex(i);
    const sdf::JointAxis *axis = joint.Axis(0);
    std::cout << (i ? ", " : "") << "\"" << joint.Name() << "\": {\"effort\": "
              << (axis ? axis->Effort() : 0.0) << ", \"friction\": "
              << (axis ? axis->Friction() : 0.0) << ", \"damping\": "
              << (axis ? axis->Damping() : 0.0) << "}";
  }
  std::cout << "}, \"followed\": {";
  const char *comma = "";
  for (auto tag = model->Element()->FindElement("plugin"); tag;
       tag = tag->GetNextElement("plugin")) {
    std::cout << comma << "\"" << tag->Get<std::string>("joint_name") << "\": \""
              << tag->Get<std::string>("topic") << "\"";
    comma = ", ";
  }
  std::cout << "}}\n";
}
