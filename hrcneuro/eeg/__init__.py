"""The numbers of EEG: filters, ocular correction, channels, epochs, wavelets, statistics; the synthetic recording."""
