"""Steps of `tools.train_embedded_encoder`: pictures, phrases, features, training, evaluation."""
