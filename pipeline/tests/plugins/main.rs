//! Stages that run as processes of their own: what they exchange, and what becomes of those that break the protocol.
#![cfg(unix)]

mod broken;
mod cache;
mod exchange;
mod support;
