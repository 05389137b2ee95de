//! Configuration, telemetry, health and shutdown shared by the services.
